"""What every effect of the catalogue must do, whatever its physics."""

from math import isfinite

import casadi as ca
import numpy as np
import pytest
from conftest import PLANT_MODELS

from workbench.effects import CATALOGUE
from workbench.effects.timing import Timing
from workbench.plants import PLANTS
from workbench.units import suffix

DIMENSIONLESS = {
    "asymmetry",
    "change",
    "coefficient",
    "exponent",
    "fraction",
    "index",
    "ratio",
    "share",
    "slope",
    "turns",
    "weight",
}
QUICKLY = [
    pytest.param(plant, id=name, marks=[pytest.mark.slow] * (name == "crr_leg"))
    for name, plant in PLANT_MODELS.items()
]  # the leg has no effect that no other plant has, and takes a minute and a half
SMALL_SHARE = 1e-3  # of the typical strength: the secant of a kinked cause


def strengths(member):
    return {k: v.null for k, v in member.parameters().items() if v.null is not None}


def silenced(plant, member):
    return plant.with_values({f"{member.name}.{k}": null for k, null in strengths(member).items()})


def with_siblings(plant, member, key):
    """One strength at null, the others of its effect present: a modifier needs what it modifies."""
    values = {
        f"{member.name}.{k}": v.typical
        for k, v in member.parameters().items()
        if v.null is not None and getattr(member, k) == v.null
    }
    return plant.with_values(values | {f"{member.name}.{key}": strengths(member)[key]})


def kinked(member, key):
    return any(cause.kinked and cause.strength == key for cause in member.causes)


def acts_on_sequences(member):
    """Alone: a line delays, and weakens the flow too."""
    return isinstance(member, Timing) and type(member).alter is Timing.alter


def answers(plant, at):
    """Rates of the states and outputs, by name, each of shape (n,)."""
    columns = plant.model.f.map(at.x.shape[1])(at.x, at.u, at.d, plant.nominal[2])
    names = (*(f"rate of {name}" for name in plant.model.states), *plant.model.measured)
    return dict(zip(names, np.vstack([c.full() for c in columns]), strict=True))


def slope(plant, at, name):
    """Derivative of rates and outputs in one parameter, shape (n_x + n_y, n)."""
    x, u, d, p = plant.model.symbols
    results = ca.vertcat(plant.model.rates, plant.model.outputs)
    column = ca.jacobian(results, p[plant.model.parameters.index(name)])
    n = at.x.shape[1]
    return ca.Function("slope", [x, u, d, p], [column]).map(n)(*at[:3], plant.nominal[2]).full()


@pytest.mark.parametrize("kind", CATALOGUE, ids=lambda kind: kind.__name__)
def test_an_effect_names_its_source_and_so_does_each_of_its_causes(kind):
    assert "Source:" in kind.__doc__
    for cause in kind.causes:
        assert cause.source
        assert cause.shown_by
        assert cause.drivers


@pytest.mark.parametrize("kind", CATALOGUE, ids=lambda kind: kind.__name__)
def test_a_cause_speaks_of_parameters_that_its_effect_has(kind):
    known = kind.parameters()
    for cause in kind.causes:
        assert known[cause.strength].null is not None
        assert {*cause.forms, *cause.shapes} <= {k for k, v in known.items() if v.null is None}
        assert cause.held is None or cause.held in known


def test_every_effect_of_the_catalogue_is_in_some_plant():
    """So that the tests below, which run over plants, leave none out."""
    used = {type(effect) for build in PLANTS.values() for effect in build().effects}

    assert used == set(CATALOGUE)


def test_every_parameter_ends_in_a_known_unit_or_is_known_to_have_none(plant):
    unknown = [
        name
        for name in plant.parameters
        if not suffix(name) and name.rpartition("_")[2] not in DIMENSIONLESS
        if name.rpartition(".")[2] not in DIMENSIONLESS
    ]

    assert not unknown


def test_the_null_and_the_typical_value_of_a_parameter_lie_within_its_bounds(plant):
    for name, known in plant.parameters.items():
        assert known.lower <= known.typical <= known.upper, name
        assert known.lower <= plant.values[name] <= known.upper, name
        assert known.relative_deviation >= 0 and known.deviation >= 0, name
        if known.null is not None:
            assert known.lower <= known.null <= known.upper, name
            assert known.typical != known.null, name


def test_the_sizes_that_a_scan_tries_lie_within_the_bounds(plant):
    for candidate in plant.candidates.values():
        known = plant.parameters[candidate.strength]
        for size in candidate.cause.sizes:
            for sign in (1, -1) if known.signed else (1,):
                value = known.null + sign * size * (known.typical - known.null)
                assert known.lower <= value <= known.upper, candidate.name


@pytest.mark.parametrize("plant", QUICKLY, indirect=True)
def test_an_effect_at_null_is_the_same_as_no_effect(plant, conditions):
    at = conditions(plant)
    for effect in plant.effects:
        null = silenced(plant, effect)
        if not next(e for e in null.effects if e.name == effect.name).absent:
            continue  # a valve or a weight is there whatever its flaws
        removed = plant.without(effect.name)
        kept = [k for k, name in enumerate(plant.model.states) if name in removed.model.states]
        present, without = answers(null, at), answers(removed, at._replace(x=at.x[kept]))
        for name, values in without.items():
            np.testing.assert_array_equal(present[name], values, err_msg=f"{effect.name}: {name}")


@pytest.mark.parametrize("plant", QUICKLY, indirect=True)
def test_a_strength_at_null_can_still_be_felt_by_the_derivative(plant, conditions):
    """Where the law has a kink at null, by a short secant instead."""
    at = conditions(plant, n=1000, spread=2.0)
    for member in plant.members:
        for key in () if acts_on_sequences(member) else strengths(member):
            name, known = f"{member.name}.{key}", member.parameters()[key]
            null = with_siblings(plant, member, key)
            column = slope(null, at, name)
            if kinked(member, key):
                little = known.null + SMALL_SHARE * (known.typical - known.null)
                here, there = answers(null, at), answers(null.with_values({name: little}), at)
                column = np.array([there[k] - here[k] for k in here])

            assert np.isfinite(column).all(), f"{name} has no finite slope at null"
            assert np.any(column), f"{name} cannot be found: it has no slope at null"


def test_every_rate_and_slope_is_finite_even_where_no_gas_can_be(plant, conditions):
    """Solvers try negative pressures and positions behind the wall before they settle."""
    at = conditions(plant, n=200)
    x = plant.scale[:, None] * np.random.default_rng(3).uniform(-20, 20, at.x.shape)
    wild = at._replace(x=x, d=at.d * np.random.default_rng(4).uniform(-3, 3, at.d.shape))
    model = plant.model
    derivatives = ["rates", "outputs", "jac:rates:x", "jac:rates:u", "jac:rates:p", "jac:outputs:p"]
    everything = model.f.factory("everything", [*"xudp"], derivatives)

    for values, name in zip(everything.map(200)(*wild), derivatives, strict=True):
        assert np.isfinite(values.full()).all(), name


def test_the_physics_is_one_expression_for_numbers_and_symbols(plant, conditions):
    """A Jacobian by automatic differentiation agrees with central differences."""
    at = conditions(plant, n=20, spread=0.2)
    model = plant.model
    jacobian = model.f.factory("j", [*"xudp"], ["jac:rates:x"])
    agree = []
    for x, u, d in zip(at.x.T, at.u.T, at.d.T, strict=True):
        exact = jacobian(x, u, d, at.p).full()
        for k, h in enumerate(1e-7 * plant.scale):
            e = h * np.eye(len(x))[k]
            there, here = (model.f(x + s * e, u, d, at.p)[0].full().ravel() for s in (1, -1))
            size = np.abs(exact[:, k]) + 1e-9 * np.abs(there) / h + 1e-9
            agree.append(np.abs((there - here) / (2 * h) - exact[:, k]) < 1e-3 * size)

    assert np.mean(agree) > 0.999 if agree else not model.states


def mass_flow_kg_s(plant, effect, balances, at):
    """What an effect puts into these balances together, shape (n,)."""
    flows = plant.model.flows
    together = sum(flows.get((effect, "MassFlow", balance), 0.0) for balance in balances)
    n = at.x.shape[1]
    return ca.Function("flow", [*plant.model.symbols], [together]).map(n)(*at).full().ravel()


def test_a_piston_leak_takes_from_one_chamber_what_it_gives_to_the_other(conditions):
    plant = PLANTS["servo_drive"]().with_values({"piston_leak.area_m2": 5e-7})
    at, chambers = conditions(plant), ("chamber_a", "chamber_b")

    assert mass_flow_kg_s(plant, "piston_leak", chambers, at) == pytest.approx(0.0, abs=1e-18)
    assert np.any(mass_flow_kg_s(plant, "piston_leak", chambers[:1], at))


def test_what_the_valve_takes_from_the_supply_goes_into_the_chambers_or_out(conditions):
    """Outside at the pressure of the chambers nothing goes out, and the balance closes."""
    plant = PLANTS["servo_drive"]()
    balances = ("supply", "chamber_a", "chamber_b")
    at = conditions(plant)
    lost_kg_s = mass_flow_kg_s(plant, "valve", balances, at)
    pressures = [k for k, name in enumerate(plant.model.states) if name.endswith("pressure_pa")]
    vented = at.x.copy()
    vented[pressures] = plant.values["atmosphere.pressure_pa"]
    closed_kg_s = mass_flow_kg_s(plant, "valve", balances, at._replace(x=vented))

    assert (lost_kg_s < 0).all()
    assert closed_kg_s == pytest.approx(0.0, abs=1e-17)


def test_a_chamber_leak_only_loses_while_the_chamber_is_above_the_atmosphere(conditions):
    plant = PLANTS["servo_drive"]().with_values({"chamber_leak@chamber_a.area_m2": 3e-7})
    lost_kg_s = mass_flow_kg_s(plant, "chamber_leak@chamber_a", ("chamber_a",), conditions(plant))

    assert (lost_kg_s < 0).all()


def test_a_value_outside_its_range_is_refused_by_name(plant):
    for name, known in plant.parameters.items():
        if isfinite(known.lower):
            with pytest.raises(ValueError, match=r"outside \["):
                plant.with_values({name: known.lower - 1.0})


def test_friction_outside_its_range_says_which_value_and_which_range():
    drive = PLANTS["servo_drive"]()

    with pytest.raises(ValueError, match=r"friction.coulomb_force_n is -1, outside \[0, 1000\]"):
        drive.with_values({"friction.coulomb_force_n": -1.0})

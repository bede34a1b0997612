"""Units at the border: what a user types becomes SI once, to the last bit, or is refused."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench import units
from workbench.plants import PLANTS
from workbench.units import UnitError, deviation, display_unit, public_name, quantity, si_unit

FINITE = st.floats(allow_nan=False, allow_infinity=False)


@pytest.mark.parametrize(
    ("name", "public", "unit"),
    [
        ("slide.position_m", "slide.position", "m"),
        ("slide.velocity_m_s", "slide.velocity", "m/s"),
        ("friction.viscous_n_s_m", "friction.viscous", "N s/m"),
        ("friction.steepness_s_m", "friction.steepness", "s/m"),
        ("chamber_a.pressure_pa", "chamber_a.pressure", "Pa"),
        ("sensor_offset@rod.force.offset_n", "sensor_offset@rod.force.offset", "N"),
        ("law[v^3]@slide.cubic_n_s3_m3", "law[v^3]@slide.cubic", "N s^3/m^3"),
        (
            "law[v|x - mid|]@slide.placed_viscous_n_s_m2",
            "law[v|x - mid|]@slide.placed_viscous",
            "N s/m^2",
        ),
        ("law[(x - mid)^2]@slide.curved_n_m2", "law[(x - mid)^2]@slide.curved", "N/m^2"),
        ("law[|v|]@chamber_a.speed_kg_m", "law[|v|]@chamber_a.speed", "kg/m"),
        ("friction.presliding_share", "friction.presliding_share", ""),
        ("chamber_a.m", "chamber_a.m", ""),
    ],
)
def test_a_name_ends_in_its_unit_and_the_longest_counts(name, public, unit):
    assert (public_name(name), si_unit(name)) == (public, unit)


@pytest.mark.parametrize(
    ("typed", "name", "value"),
    [
        ("6 bar_gauge", "supply.pressure_pa", 7e5),
        ("0 psi_gauge", "supply.pressure_pa", 1e5),
        ("100 psi", "supply.pressure_pa", 689475.7293168),
        ("0.05 mm^2", "chamber_leak.area_m2", 5e-8),
        ("0.05 mm2", "chamber_leak.area_m2", 5e-8),
        ("5 mm", "end_cushion.length_m", 0.005),
        ("22.5 W/(m^2 K)", "wall_heat.coefficient_w_m2_k", 22.5),
        ("20 degC", "supply.temperature_k", 293.15),
        ("2 N/bar", "friction.pressure_factor_n_pa", 2e-5),
        ("1 %", "friction.presliding_share", 0.01),
        ("0.25", "friction.presliding_share", 0.25),
        ("0.25 -", "friction.presliding_share", 0.25),
        ("0.25 dimensionless", "friction.presliding_share", 0.25),
        (1, "friction.presliding_share", 1.0),
    ],
)
def test_quantities_become_si(typed, name, value):
    assert quantity(typed, name, ambient_pa=1e5) == pytest.approx(value, rel=1e-13)


@pytest.mark.parametrize(
    ("typed", "name", "message"),
    [
        ("6 baar", "supply.pressure_pa", "unit 'baar' is unknown; did you mean 'bar'?"),
        ("2 s", "slide.mass_kg", "unit 's' does not fit; expected kg"),
        ("2 bar_gauge", "slide.mass_kg", "is a gauge pressure; expected kg"),
        (2.22, "slide.mass_kg", "'2.22' has no unit; expected \"2.22 kg\""),
        ("2,22 kg", "slide.mass_kg", "expected a decimal point"),
        ("heavy", "slide.mass_kg", "does not start with a number"),
        (True, "slide.mass_kg", "is no quantity"),
        ("3 kg", "friction.presliding_share", "expected a plain number"),
    ],
)
def test_what_cannot_be_read_is_refused_with_what_was_expected(typed, name, message):
    with pytest.raises(UnitError) as refused:
        quantity(typed, name)

    assert message in str(refused.value)


@pytest.mark.parametrize(
    ("typed", "value", "expected"),
    [("1 %", 2.0, 0.02), ("2 degC", 293.15, 2.0), ("0.1 bar_gauge", 7e5, 1e4)],
)
def test_a_standard_deviation_is_relative_or_a_difference(typed, value, expected):
    name = "supply.temperature_k" if "deg" in typed else "supply.pressure_pa"

    assert deviation(typed, name, value) == pytest.approx(expected)


@pytest.mark.parametrize(("typed", "message"), [("-1 %", "from 0 on"), ("5 %", "says nothing")])
def test_a_standard_deviation_that_says_nothing_is_refused(typed, message):
    with pytest.raises(UnitError, match=message):
        deviation(typed, "chamber_leak.area_m2", 0.0)


@given(value=FINITE, suffix=st.sampled_from([*units._UNITS]))
def test_what_is_written_reads_back_to_the_very_same_float(value, suffix):
    name = f"part.quantity_{suffix}"

    assert quantity(units.written(value, name), name) == value


def test_every_unit_of_the_table_can_be_read_and_shown():
    for suffix in units._UNITS:
        name = f"part.quantity_{suffix}"

        assert units.suffix(name) == suffix
        assert units.scale(display_unit(name), name).factor > 0
        assert units.scale(si_unit(name), name).factor == 1


@pytest.mark.parametrize("plant", PLANTS)
def test_no_two_parameters_of_a_plant_have_the_same_public_name(plant):
    names = [public_name(name) for name in PLANTS[plant]().values]

    assert len(set(names)) == len(names)

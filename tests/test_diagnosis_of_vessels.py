"""Diagnosis of what does not move: window lengths, the balances that may lack a flow, and decays.

Made decays come from a few lines of NumPy with the ideal gas and a nozzle or a warm wall, none of
it the workbench's.
"""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from workbench.balances import BalanceEquation
from workbench.diagnosis.diagnose import _where_told, diagnose
from workbench.diagnosis.result import Verdict
from workbench.diagnosis.suspects import suspects, wandering, with_missing_flows
from workbench.diagnosis.where import locate
from workbench.effect import Balance, Part, State, Term
from workbench.fitting.problem import pose
from workbench.fitting.window_length import time_constant_s, window_length_s
from workbench.plant import Plant
from workbench.plants import PLANTS
from workbench.recording import Recording
from workbench.recordings import chamber_decay, real_data_folder
from workbench.rig import default_rig
from workbench.units import display_unit

PRESSURE, LEVEL = "chamber.pressure_pa", "tank.level_m3"
DATA = real_data_folder()
GAMMA, GAS_J_KG_K, ROOM_K = 1.4, 287.05, 293.15
VOLUME_M3, SURFACE_M2 = 1e-4, 1.3e-2  # those that the plant takes for granted
NOISE_PA, SAMPLE_S = 100.0, 0.1


def decay(seconds, seed, start_pa=8e5, area_m2=0.0, warmer_k=0.0, heat_w_k=0.0):
    """Pressure of a rigid chamber with a choked leak and heat to a wall, Euler steps of 10 ms."""
    random, dt = np.random.default_rng(seed), 0.01
    pressure, temperature, seen = start_pa, ROOM_K + warmer_k, []
    choked = np.sqrt(GAMMA / GAS_J_KG_K) * (2 / (GAMMA + 1)) ** ((GAMMA + 1) / (2 * GAMMA - 2))
    for k in range(round(seconds / dt)):
        if k % 10 == 0:
            seen.append(pressure)
        mass = pressure * VOLUME_M3 / (GAS_J_KG_K * temperature)
        lost = area_m2 * choked * pressure / np.sqrt(temperature)
        heat = heat_w_k * (ROOM_K - temperature)
        energy = -GAMMA * GAS_J_KG_K * temperature * lost + (GAMMA - 1) * heat
        pressure += dt * energy / VOLUME_M3
        temperature = pressure * VOLUME_M3 / (GAS_J_KG_K * (mass - dt * lost))
    values = np.array(seen) + NOISE_PA * random.standard_normal(len(seen))
    return Recording(f"decay {seed}", SAMPLE_S, {PRESSURE: values}, noise={PRESSURE: NOISE_PA})


@pytest.fixture(scope="module")
def leaking():
    """A decay of a minute through 2e-11 m2, and two shorter ones from other pressures."""
    return [decay(s, k, p, area_m2=2e-11) for s, k, p in ((60, 1, 8e5), (40, 2, 6e5), (45, 3, 7e5))]


def drive_recording(sample_time_s=1e-3, n=3000):
    t = sample_time_s * np.arange(n)
    channels = {
        "valve.command_v": 5.0 + 2.0 * np.sin(7.0 * t),
        "slide.position_m": 0.1 + 0.02 * np.sin(7.0 * t),
        "chamber_a.pressure_pa": 4e5 + 1e5 * np.cos(7.0 * t),
        "chamber_b.pressure_pa": 4e5 - 1e5 * np.cos(7.0 * t),
    }
    return Recording("drive", sample_time_s, channels)


@pytest.mark.parametrize(("sample_time_s", "expected_s"), [(1e-3, 0.2), (1e-2, 0.2), (2e-2, 0.4)])
def test_where_something_moves_windows_stay_short_with_twenty_samples_at_least(
    sample_time_s, expected_s
):
    recorded = drive_recording(sample_time_s)
    plant = default_rig("servo_drive").fit_for(recorded)

    assert window_length_s(plant, [recorded]) == pytest.approx(expected_s)


def test_a_decay_slower_than_its_recording_stays_whole_and_several_fit_the_shortest(leaking):
    plant = chamber_decay.rig().plant.lean()

    assert time_constant_s(plant, leaking) == np.inf
    assert window_length_s(plant, leaking[:1]) == pytest.approx(60.0)
    assert window_length_s(plant, leaking[:1], leaking[1:]) == pytest.approx(40.0)


@dataclass(frozen=True, kw_only=True)
class Vented(Part):
    """A user's own part: a pressure that goes to nothing with one time constant."""

    time_constant_s: float

    def states(self):
        yield State("pressure_pa", 1e5, scale=1e5)

    def rates(self, now, received):
        return {"pressure_pa": -now[self.name].pressure_pa / self.time_constant_s}


@pytest.mark.parametrize(
    ("time_constant", "expected_s"),
    [(0.05, 0.2), (0.1, 0.3), (2.0, 10 / 24), (4.0, 10.0)],
    ids=["twenty samples", "three time constants", "a 24th of the training", "the whole"],
)
def test_where_nothing_moves_windows_follow_the_time_constant(time_constant, expected_s):
    part = Vented(name="tank", time_constant_s=time_constant)
    plant = Plant(name="vented", parts=(part,), measured=("tank.pressure_pa",))
    falling = 1e5 * np.exp(-0.01 * np.arange(1000) / time_constant)
    recorded = Recording("vented", 0.01, {"tank.pressure_pa": falling})

    assert time_constant_s(plant, [recorded]) == pytest.approx(time_constant)
    assert window_length_s(plant, [recorded]) == pytest.approx(expected_s, rel=0.05)


BALANCES = {
    "closed_chamber": {"chamber.mass", "chamber.energy"},
    "servo_reservoir": {"reservoir.mass", "reservoir.energy"},
    "soft_joint": {"bellows.mass"},
    "soft_joint_parametric": {"bellows.mass"},
    "gearbox": {
        *("main_piston.momentum", "floating_piston.momentum", "finger.momentum"),
        *(f"{c}.{b}" for c in ("chamber_1", "chamber_2", "control_chamber")
          for b in ("mass", "energy")),
    },
    "crr_leg": {
        *(f"joint_{k}.momentum" for k in (1, 2, 3)),
        *(f"{c}_{k}.{b}" for c in ("cap", "rod_side") for k in (1, 2, 3)
          for b in ("mass", "energy")),
    },
}  # fmt: skip


@pytest.mark.parametrize("name", BALANCES)
def test_every_balance_of_a_plant_may_lack_a_flow(name):
    _, flows = with_missing_flows(PLANTS[name]().lean())

    assert {flow.place for flow in flows} == BALANCES[name]


def test_a_missing_flow_acts_as_the_laws_of_gas_and_of_levers_say():
    """kappa R T/V per kg/s, (kappa - 1)/V per W, and 1/J per N m."""
    chamber, _ = with_missing_flows(PLANTS["closed_chamber"]().lean())
    states = list(chamber.model.states)

    def answer(plant, parameter, size):
        given = plant.nominal[2].copy()
        given[list(plant.model.parameters).index(parameter)] = size
        return plant.model.f(plant.initial, *plant.nominal[:2], given)[0].full().ravel()

    gas = answer(chamber, "missing@chamber.mass.flow", 1e-6)
    heat = answer(chamber, "missing@chamber.energy.flow", 2.0)
    pressure, mass = states.index(PRESSURE), states.index("chamber.mass_kg")
    assert gas[pressure] == pytest.approx(1e-6 * 1.4 * GAS_J_KG_K * ROOM_K / VOLUME_M3, rel=1e-3)
    assert gas[mass] == pytest.approx(1e-6)
    assert heat[pressure] == pytest.approx(2.0 * 0.4 / VOLUME_M3)
    assert heat[mass] == 0.0
    gearbox, _ = with_missing_flows(PLANTS["gearbox"]().lean())
    still = gearbox.model.f(gearbox.initial, *gearbox.nominal)[0].full().ravel()
    turned = answer(gearbox, "missing@finger.momentum.flow", 0.3) - still
    row = list(gearbox.model.states).index("finger.velocity_rad_s")
    assert turned[row] == pytest.approx(0.3 / 1.5e-3)
    assert display_unit("torque_n_m") == "N m"


@dataclass(frozen=True, kw_only=True)
class Charge(Term):
    """What a user's own part balances."""


@dataclass(frozen=True, kw_only=True)
class Store(Part):
    """A user's own part: a level that a flow fills."""

    balances = (
        BalanceEquation(
            balance=Balance.MASS,
            kind=Charge,
            term="volume_flow_m3_s",
            state="level_m3",
            rates=(1e-3, 1e-2),
        ),
    )

    def states(self):
        yield State("level_m3", 1.0, scale=1.0)

    def rates(self, now, received):
        return {"level_m3": sum(term.value for term in received(self.name)) / 2.0}


def test_a_user_s_own_part_declares_its_balance():
    plant = Plant(name="own", parts=(Store(name="tank"),), measured=(LEVEL,))
    recorded = Recording("level", 0.1, {LEVEL: np.linspace(1.0, 2.0, 100)})
    whole, flows = with_missing_flows(plant)
    rig = replace(default_rig("closed_chamber"), plant=plant)
    problem = pose(rig, [replace(recorded, noise={LEVEL: 1e-3})])
    astray = wandering(whole, problem.base.windows)
    (found,) = suspects(whole, flows, recorded, astray)
    where = locate(problem, [recorded])

    assert found.balance == where.balance == "tank.mass"
    assert np.array(found.intensities) == pytest.approx(2.0 * np.array(astray.rates[LEVEL]))
    assert where.term.mean() == pytest.approx(2.0 * 1.0 / 9.9, rel=0.1)  # half of a flow is a rate


def test_the_missing_flow_of_a_leaking_chamber_is_found_in_kg_s(leaking):
    problem = pose(chamber_decay.rig(), leaking[:1])
    where = locate(problem, leaking[:1])
    recorded = leaking[0][PRESSURE]
    slope_pa_s = (recorded[-50:].mean() - recorded[:50].mean()) / 55.0
    lost_kg_s = slope_pa_s * VOLUME_M3 / (1.4 * GAS_J_KG_K * ROOM_K)

    assert where.balance == "chamber.mass"
    assert where.term_name == "mass_flow_kg_s"
    assert all(gain > 50.0 for gain in where.by_balance.values())
    assert where.term.mean() == pytest.approx(lost_kg_s, rel=0.15)


def test_what_is_missing_is_followed_through_all_training_recordings(leaking):
    problem = pose(chamber_decay.rig(), leaking[:2])
    both, first = (locate(problem, leaking[:n]) for n in (2, 1))
    in_first = both.time_s < 60.0

    assert both.balance == "chamber.mass"
    assert both.time_s[-1] == pytest.approx(100.0, rel=0.01)
    assert both.by_balance["chamber.mass"] > first.by_balance["chamber.mass"] + 50.0
    assert both.term[in_first].mean() == pytest.approx(first.term.mean(), rel=0.02)
    assert both.term[~in_first].mean() < 0.5 * first.term.mean() < 0.0  # gas leaves there too


@pytest.mark.parametrize("named", ["chamber.mass", "chamber.energy"])
def test_where_is_the_balance_of_the_law_that_is_told(leaking, named):
    problem = pose(chamber_decay.rig(), leaking[:1])
    found = locate(problem, leaking[:1])
    told = _where_told(problem, leaking[:1], found, SimpleNamespace(balances=(named,)))

    assert told.balance == named and told.certain
    assert told.by_law == (named != found.balance)
    assert told.term_name == {"chamber.mass": "mass_flow_kg_s"}.get(named, "heat_flow_w")
    assert told.by_balance == pytest.approx(found.by_balance)
    assert _where_told(problem, leaking[:1], found, None) is found


def test_where_nothing_was_recorded_for_long_nothing_is_told_of_what_is_missing(leaking):
    """From 20 to 40 s: two seconds, twenty samples, around what was heard are told."""
    holed = leaking[0][PRESSURE].copy()
    holed[200:400] = np.nan
    recorded = replace(leaking[0], channels={PRESSURE: holed})
    where = locate(pose(chamber_decay.rig(), [recorded]), [recorded])

    assert np.diff(where.time_s).max() == pytest.approx(20.1 - 2 * 2.0, abs=0.1)
    assert not ((where.time_s > 22.05) & (where.time_s < 37.95)).any()
    assert len(where.term) == len(where.time_s) == len(where.term_deviation)
    assert where.course.states.shape[1] == len(where.time_s)


def test_the_walls_of_a_leak_and_of_cooling_are_a_tie_in_a_minute(leaking):
    found = diagnose(chamber_decay.rig(), leaking[:2], leaking[2:])
    leader = found.ranking[0]

    assert found.verdict is Verdict.TIE
    assert {leader.candidate.name, *leader.tied_with} == {"chamber_leak", "wall_heat"}
    leak = next(row for row in found.ranking if row.candidate.name == "chamber_leak")
    assert leak.size["chamber_leak.area_m2"].value == pytest.approx(2e-11, rel=0.1)


def test_a_chamber_that_holds_its_gas_lacks_nothing():
    tight = [decay(60, 11), decay(40, 12, 6e5)]
    found = diagnose(chamber_decay.rig(), tight[:1], tight[1:])

    assert found.verdict is Verdict.NOTHING_MISSING
    assert not any(row.accepted for row in found.ranking)


@pytest.mark.slow
def test_a_chamber_that_cools_within_seconds_has_no_leak():
    """15 K above the wall with a time constant of 7 s: no hole empties a chamber like that."""
    cooling = [decay(40, 21, warmer_k=3.0, heat_w_k=0.1), decay(30, 22, 6e5, 0.0, 3.0, 0.1)]
    found = diagnose(chamber_decay.rig(), cooling[:1], cooling[1:])

    assert found.ranking[0].candidate.name == "wall_heat"


needs_data = pytest.mark.skipif(DATA is None, reason="the real recordings are not there")


@needs_data
@pytest.mark.slow
@pytest.mark.parametrize("name", chamber_decay.CHAMBERS)
def test_a_real_chamber_leaks_or_cools(name):
    train, rest = chamber_decay.recordings(DATA, name)
    found = diagnose(chamber_decay.rig(), [train], [rest])
    leader = found.ranking[0]

    assert found.verdict is Verdict.TIE
    assert {leader.candidate.name, *leader.tied_with} == {"chamber_leak", "wall_heat"}
    assert found.where.balance in ("chamber.mass", "chamber.energy")

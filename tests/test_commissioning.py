"""Commissioning of the gearbox: what is played, what is recorded of it, and what a fit learns."""

from itertools import pairwise

import numpy as np
import pytest
from driven_gearbox import DRIVEN

from studies.checking import drawn
from studies.commissioning import claims, commissioned, played, reached_table, recorded
from studies.shift_check import NOISE, SHIFTS, Shift
from workbench.fitting.errors import errors_of
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.linearised import Point
from workbench.fitting.problem import ITERATIONS, pose
from workbench.fitting.short_windows import better_from_short_windows
from workbench.plants.gearbox import COMMANDS, gearbox
from workbench.rig import default_rig
from workbench.simulation import simulate

OTHER = gearbox().with_values(
    {
        "supply.pressure_pa": 8.7e5,
        "chamber_1.dead_volume_m3": 16e-6,
        "valve_1.discharge_coefficient": 0.75,
        "valve_2.discharge_coefficient": 0.69,
        "detent.force_n": 320.0,
    }
)


def shifts(*settling_s):
    """Each of the four shifts once, within its bounds but for its time, which may be 25 ms."""
    rows = []
    for scenario, time_s in zip(SHIFTS, settling_s, strict=True):
        numbers = dict.fromkeys(Shift.__dataclass_fields__, 0.0) | {"longest_s": 0.025}
        numbers |= {"design": "hybrid MPC 1", "scenario": scenario, "settling_s": time_s}
        rows.append(Shift(**numbers))
    return rows


GOOD, LATE = shifts(0.02, 0.02, 0.02, 0.02), shifts(0.03, 0.02, 0.02, 0.03)


def test_whole_shifts_and_pulses_that_end_before_the_piston_arrives_are_played():
    commands = played().rows(COMMANDS)
    changes = np.flatnonzero(np.abs(np.diff(commands)).sum(axis=0))
    stood = {tuple(commands[:, k + 1]): [] for k in changes}
    for k, until in pairwise(changes):
        stood[tuple(commands[:, k + 1])].append(until - k)

    assert set(stood) == {(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)}
    for one_valve in ((1.0, 0.0), (0.0, 1.0)):
        assert min(stood[one_valve]) < 20 < 50 < max(stood[one_valve])


def test_most_pulses_of_either_valve_are_as_short_as_a_brake():
    commands = played().rows(COMMANDS)
    lasts = [np.diff(np.flatnonzero(np.diff(row, prepend=0.0)))[::2] for row in commands]

    assert all(np.mean(each < 20) > 0.5 and np.sum(each < 10) >= 3 for each in lasts)


def test_every_actuator_is_played_the_same_with_noise_of_its_own():
    first, second, other = recorded(OTHER, 0), recorded(OTHER, 1), recorded(gearbox(), 0)
    exact = simulate(OTHER.lean(), played())

    assert np.array_equal(first.rows(COMMANDS), other.rows(COMMANDS))
    for name, deviation in NOISE.items():
        assert np.std(first[name] - exact[name]) == pytest.approx(deviation, rel=0.1)
        assert not np.allclose(first[name], second[name], rtol=0.0, atol=deviation)


def test_shifts_are_counted_by_what_is_known_of_the_plant():
    told = reached_table({"as delivered": LATE, "after": GOOD}).splitlines()

    assert told[0].split() == ["fast", "and", "soft", *SHIFTS, "all"]
    assert told[1].split("of")[0].split() == ["as", "delivered", "0"]
    assert told[1].endswith("2 of 4") and told[2].endswith("4 of 4")


def test_a_commissioning_that_saves_no_shift_is_told():
    held = {claim.claim: claim for claim in claims(LATE, LATE)}
    better = {claim.claim: claim for claim in claims(GOOD, LATE)}
    saved = "after commissioning fewer shifts are missed, or none"

    assert not held[saved].holds and held[saved].found == "2 instead of 2"
    assert better[saved].holds and all(claim.holds for claim in better.values())
    assert not held["after commissioning: n-h is fast and soft on every drawn plant"].holds
    assert held["after commissioning: h-n is fast and soft on every drawn plant"].holds


@pytest.mark.slow
def test_one_recording_halves_what_is_wrong_of_supply_flows_dead_volume_and_detent():
    fitted, first = commissioned(OTHER, 0).rig.plant.values, gearbox().values
    changed = [name for name, value in OTHER.values.items() if value != first[name]]
    left = [abs(fitted[n] - OTHER.values[n]) / abs(first[n] - OTHER.values[n]) for n in changed]

    assert len(changed) == 5
    assert max(left) < 0.5


@pytest.mark.slow
def test_short_windows_lead_out_of_a_valley_where_every_impact_comes_at_the_wrong_instant():
    """A fit of a drawn actuator that begins three prior deviations off ends in such a valley."""
    truth = drawn(default_rig(gearbox()), np.random.default_rng(8))
    recording = recorded(truth, 7, DRIVEN)
    from_priors = pose(default_rig(gearbox()), [recording])
    valley = from_priors.with_base(astray(from_priors.base, 3.0))
    found = better_from_short_windows(valley, [recording])

    assert worst(valley) > 3.0
    assert worst(found) < 1.5
    assert better_from_short_windows(found, [recording]) is found


def astray(base, deviations):
    """The fit from where every parameter is off its prior, to either side in turn."""
    windows, unknowns = base.windows, base.unknowns
    off = unknowns.clipped(np.resize((deviations, -deviations), len(unknowns)))
    return fit_windows(windows, unknowns, Point(off, windows.start), ITERATIONS)


def worst(problem):
    """Largest mean square error of an output over that of its noise."""
    found = errors_of(problem.base, None)["train"]
    return max(each.chi2_per_sample for each in found.values())

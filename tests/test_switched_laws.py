"""What is certified of laws that change is the loop that runs: memories that go on, and mixes."""

import numpy as np
import pytest

from controllers.derivative import LowPassDerivative, SpanDerivative
from controllers.margins import closed, crossed, in_volts, integral_of, loops
from controllers.per_mode import per_mode
from controllers.pid_tuning import PidParts, pid_with
from controllers.scheduled import Schedule, driven_modes
from controllers.two_degree_pid import PidGains, law_of
from linearize.discrete import sampled
from linearize.standard import axis_modes, standard_modes
from workbench.contracts import Estimate
from workbench.plants.crr_rig import crr_rig
from workbench.plants.servo_drive import servo_drive

DT, PLACE = 1e-3, 0.08
ONE = PidGains(proportional=20.0, integral=40.0, derivative=0.2)
OTHER = PidGains(proportional=35.0, integral=9.0, derivative=0.5)


@pytest.fixture(scope="module")
def hybrid():
    return axis_modes(crr_rig())


@pytest.fixture(scope="module")
def mode(hybrid):
    return driven_modes(hybrid)[0][1]


def run(mode, pids, turns, start):
    """States of the mode under PIDs that take turns on one memory, scaled, (n, 4)."""
    small, command, x = sampled(mode, DT), pids[0].start(), np.zeros(4)
    held, found = np.full((1, pids[0].preview), PLACE), []
    for k in range(-1, len(turns)):
        if k == 0:
            x = start * mode.scale
        seen = Estimate((pids[0].signal,), np.array([PLACE + x[0]]), np.zeros((1, 1)))
        command = pids[turns[max(k, 0)]].step(command, held, seen)
        found.append(x / mode.scale)
        x = small.F @ x + small.G[:, 0] * command.notes["opening_v"]
    return np.array(found[1:])


@pytest.mark.parametrize("derivative", [LowPassDerivative(3e-3), SpanDerivative(5)])
def test_pids_that_take_turns_run_as_the_loops_that_are_certified(hybrid, mode, derivative):
    """With an integral in units of the error, as it was certified, the run is another one."""
    parts, start = PidParts(derivative=derivative), np.array([1e-4, 0.0, 0.0, 0.0])
    pids = [pid_with(hybrid, gains, parts) for gains in (ONE, OTHER)]
    turns = np.arange(60) // 7 % 2
    laws = [law_of(gains, derivative.filter(DT), DT) for gains in (ONE, OTHER)]
    switched = [closed(mode, law, DT) for law in laws]
    direct = laws[0].D - laws[0].C[-1] * laws[0].B[-1]  # what goes on at the start, before any sum
    z = np.concatenate([start, np.zeros(len(laws[0].A))])
    z[-1] = direct @ (start * mode.scale)
    expected = []
    for turn in turns:
        expected.append(z[:4])
        z = switched[turn] @ z

    assert run(mode, pids, turns, start) == pytest.approx(np.array(expected), rel=1e-6, abs=1e-11)


def test_the_loop_of_one_law_has_the_same_poles_in_any_coordinates(mode):
    law = law_of(ONE, LowPassDerivative(3e-3).filter(DT), DT)
    jumping = type(law)(law.A, law.B, law.C, law.D)
    poles = [
        np.sort(abs(np.linalg.eigvals(closed(mode, each, DT, 2e-3)))) for each in (law, jumping)
    ]

    assert law.bumpless and not jumping.bumpless
    assert poles[0] == pytest.approx(poles[1], rel=1e-7)
    assert not np.allclose(closed(mode, law, DT), closed(mode, jumping, DT))


@pytest.mark.parametrize("share", [0.0, 0.3, 0.8])
def test_every_mix_of_gains_lies_between_the_loops_of_all_pairs(mode, share):
    """Direct part times integral gain: between the two laws alone it does not."""
    slopes = LowPassDerivative(3e-3).filter(DT)
    mixed = PidGains(
        **{
            key: share * getattr(ONE, key) + (1.0 - share) * getattr(OTHER, key)
            for key in PidGains.__dataclass_fields__
        }
    )
    laws = [law_of(gains, slopes, DT) for gains in (ONE, OTHER)]
    weights = [share, 1.0 - share]
    between = sum(
        a * b * closed(mode, crossed(one, other), DT)
        for a, one in zip(weights, laws, strict=True)
        for b, other in zip(weights, laws, strict=True)
    )

    assert closed(mode, law_of(mixed, slopes, DT), DT) == pytest.approx(
        between, rel=1e-7, abs=1e-12
    )


def test_loops_of_a_bumpless_law_have_every_pair_once(hybrid):
    slopes, modes = LowPassDerivative(3e-3).filter(DT), driven_modes(hybrid)[0]
    one, other = (law_of(gains, slopes, DT) for gains in (ONE, OTHER))
    sides = Schedule(np.arange(len(modes)) * 1.0, (one,) * len(modes), (other,) * len(modes))

    assert {len(each) for each in loops(hybrid, sides, DT).values()} == {4}
    alone = sides.mapped(lambda law: one)
    assert {len(each) for each in loops(hybrid, alone, DT).values()} == {1}


def test_an_integral_in_volts_goes_on_in_volts():
    """Methods by mode add K_i e up, each with its own K_i, and feed the sum back as it is."""
    law = integral_of(np.array([3.0, 1.0, 0.0, 0.0]), 7.0, DT)
    volts = in_volts(law)
    s, t = np.zeros(1), np.zeros(1)
    for x in 1e-3 * np.random.default_rng(1).standard_normal((5, 4)):
        assert volts.C @ t + volts.D @ x == pytest.approx(law.C @ s + law.D @ x)
        s, t = law.A @ s + law.B @ x, volts.A @ t + volts.B @ x
    assert t == pytest.approx(-7.0 * s)
    assert in_volts(integral_of(np.ones(4), 0.0, DT)).C == 0.0


def test_the_certified_laws_of_methods_by_mode_have_their_memory_in_volts():
    found = per_mode(standard_modes(servo_drive())).laws

    assert all(law.C.tolist() == [1.0] for law in (*found.forward, *found.backward))

"""The PID on the raw measurement: its parts against known numbers, its tuning, and the plants."""

from dataclasses import replace
from math import pi, radians

import numpy as np
import pytest

from controllers.derivative import LowPassDerivative, SpanDerivative
from controllers.margins import both_ways_s, margins_of
from controllers.pid_tuning import (
    PAPER_GAINS,
    PidParts,
    TuningSpec,
    margin_of_overshoot,
    pid_margins,
    pid_with,
    tuned_gains,
    tuned_pid,
)
from controllers.scheduled import Schedule, driven_modes
from controllers.two_degree_pid import Dither, PidGains, law_of
from estimators.raw import RawMeasurement
from linearize.standard import axis_modes, standard_modes
from studies.papers.loops import tracked
from workbench.closed_loop import Hardware, close_loop
from workbench.contracts import Estimate
from workbench.errors import InputError
from workbench.filtering import consistent_start
from workbench.plants.crr_arm import crr_arm
from workbench.plants.crr_rig import crr_rig
from workbench.plants.servo_drive import servo_drive

DT = 1e-3
BOTH = [LowPassDerivative(3e-3), SpanDerivative(5)]


@pytest.fixture(scope="module")
def rig():
    return axis_modes(crr_rig())


@pytest.fixture(scope="module")
def drive():
    return standard_modes(servo_drive())


def steps(pid, reference, positions):
    """Openings and commands along given positions; the reference stands, or has one per position.

    What comes is not seen: each is held for all of the preview.
    """
    command, found = pid.start(), []
    for r, y in zip(np.broadcast_to(reference, len(positions)), positions, strict=True):
        held = np.full((1, pid.preview), r)
        command = pid.step(command, held, Estimate((pid.signal,), np.array([y]), np.zeros((1, 1))))
        found.append((command.notes["opening_v"], float(command.value[0])))
    return np.array(found).T


def test_proportional_integral_and_setpoint_weight_are_what_they_say(rig):
    gains = PidGains(proportional=20.0, integral=5.0, derivative=0.0, setpoint=0.4)
    openings, _ = steps(pid_with(rig, gains), [0.08, *[0.09] * 3], [0.08] * 4)

    direct = 20.0 * 0.4 * 0.01
    assert openings[0] == pytest.approx(0.0, abs=1e-12)
    assert openings[1:] == pytest.approx([direct + 5.0 * 0.01 * DT * k for k in (1, 2, 3)])


def test_an_axis_at_rest_on_its_target_stays_there_whatever_the_setpoint_weight(rig):
    """P alone sent -(1 - b) K_p r: the drive of the bench ended its step 53 mm away."""
    gains = PidGains(proportional=20.0, integral=5.0, derivative=0.1, setpoint=0.4)
    openings, _ = steps(pid_with(rig, gains), 0.09, [0.09] * 50)

    assert openings == pytest.approx(0.0, abs=1e-12)


def test_a_setpoint_weight_is_kept_where_the_gains_change_with_the_mode(rig):
    """On the target the integral takes over what P loses there, and moves nothing."""
    soft = PidGains(proportional=10.0, integral=5.0, derivative=0.0, setpoint=0.4)
    hard = PidGains(proportional=60.0, integral=50.0, derivative=0.0, setpoint=0.4)
    sides = Schedule(np.array([0.08, 0.08001]), (soft, hard), (soft, hard))
    path = [0.079] * 5 + [0.081] * 5
    openings, _ = steps(pid_with(rig, sides), 0.079, path)

    assert openings[:5] == pytest.approx(0.0, abs=1e-12)
    assert openings[5:] == pytest.approx(-10.0 * 0.002, rel=0.03)


def test_gains_that_change_with_the_mode_leave_the_opening_where_it_was(rig):
    soft = PidGains(proportional=10.0, integral=5.0, derivative=0.1)
    hard = PidGains(proportional=60.0, integral=50.0, derivative=0.8)
    sides = Schedule(np.array([0.08, 0.08001]), (soft, hard), (soft, hard))
    openings, _ = steps(pid_with(rig, sides), 0.1, [0.079, 0.0799, 0.08005, 0.08006])
    unscheduled, _ = steps(pid_with(rig, hard), 0.1, [0.079, 0.0799, 0.08005, 0.08006])

    assert abs(np.diff(openings)).max() < 0.1
    assert abs(unscheduled[2] - openings[2]) > 0.5


def test_the_integral_follows_the_limit_and_comes_off_it_at_once(rig):
    gains = PidGains(proportional=100.0, integral=400.0, derivative=0.0)
    slow = pid_with(rig, gains, PidParts(tracking_time_s=1e6))
    quick = pid_with(rig, gains, PidParts(tracking_time_s=0.02))
    path = [0.02] * 600 + [0.101] * 30
    wound, kept = (steps(pid, 0.1, path)[0] for pid in (slow, quick))

    assert wound[-1] == pytest.approx(4.5, abs=0.3)
    assert kept[-1] < 2.0


def test_a_large_step_does_not_drive_the_integral_against_its_error(rig):
    """11 V are asked for; within 50 ms it fell to -1.8 V, and came back at 1.27 s."""
    gains = PidGains(proportional=220.0, integral=173.0, derivative=0.0)
    usual, short = pid_with(rig, gains), pid_with(rig, gains, PidParts(tracking_time_s=0.05))
    path = [0.05] * 50 + [0.0995] * 5
    kept, driven = (steps(pid, 0.1, path)[0] for pid in (usual, short))

    assert kept[0] == usual.valve.openings_v[1]
    assert kept[-1] > 220.0 * 0.5e-3 > 0.0 > driven[-1]


def test_without_an_integral_gain_nothing_is_left_of_a_limit(rig):
    """It had kept a bias for ever, since no error could take it away."""
    gains = PidGains(proportional=250.0, integral=0.0, derivative=8.0)
    pid = pid_with(rig, gains, PidParts(tracking_time_s=0.05))
    openings, _ = steps(pid, 0.1, [0.05] * 50 + [0.099] * 200)

    assert openings[0] == pid.valve.openings_v[1]
    assert openings[-1] == pytest.approx(250.0 * 1e-3)


def test_the_dead_zone_is_jumped_and_dither_goes_around_the_opening(drive):
    gains = PidGains(proportional=10.0, integral=0.0, derivative=0.0)
    dither = Dither(amplitude_v=0.3, frequency_hz=50.0)
    plain, shaken = (pid_with(drive, gains, PidParts(dither=d)) for d in (Dither(), dither))
    openings, commands = steps(plain, 0.15, [0.14] * 40)
    _, moved = steps(shaken, 0.15, [0.14] * 40)

    assert openings == pytest.approx(0.1)
    assert commands - 4.95 == pytest.approx(0.42 + 0.1, abs=0.02)
    assert np.ptp(moved) > 2.0 * 0.42
    assert moved[:20] == pytest.approx(moved[20:], abs=1e-6)


def test_friction_is_compensated_towards_the_target(drive):
    """At rest the opening of the wanted direction is sent before there is any integral."""
    none = PidGains(proportional=0.0, integral=0.0, derivative=0.0)
    pid = pid_with(
        drive, none, PidParts(feedforward_share=1.0, turn_per_s=50.0, standing_per_s=50.0)
    )
    ahead, _ = steps(pid, 0.150, [0.145])
    back, _ = steps(pid, 0.140, [0.145])
    wanted = pid.feedforward.sliding.forward[1].level[2]

    assert ahead[0] == pytest.approx(wanted, rel=0.02)
    assert ahead[0] > 0.0 > back[0] or ahead[0] < 0.0 < back[0]


@pytest.mark.parametrize("integral", [5.0, 0.0])
@pytest.mark.parametrize("derivative", BOTH)
def test_the_law_of_the_margins_is_the_controller(rig, derivative, integral):
    gains = PidGains(proportional=20.0, integral=integral, derivative=0.7)
    pid = pid_with(rig, gains, PidParts(derivative=derivative))
    moves = 1e-3 * np.random.default_rng(3).standard_normal(8)
    moves[0] = 0.0
    openings, _ = steps(pid, 0.076, 0.076 + moves)
    law = law_of(gains, derivative.filter(DT), DT)
    s, expected = np.zeros(len(law.A)), []
    for move in moves:
        x = np.array([move, 0.0, 0.0, 0.0])
        expected.append(law.C @ s + law.D @ x)
        s = law.A @ s + law.B @ x

    assert openings == pytest.approx(expected, abs=1e-9)


def test_overshoot_and_phase_margin_are_those_of_the_second_order_loop():
    """4.3 % of overshoot is damping 0.707, whose loop has 65.5 degrees: the textbook's values."""
    assert np.degrees(margin_of_overshoot(0.0432)) == pytest.approx(65.5, abs=0.1)
    assert margin_of_overshoot(1.0) == 0.0
    assert TuningSpec(overshoot=0.0432).margin_rad > TuningSpec(overshoot=0.3).margin_rad


def test_tuned_gains_cross_where_the_specification_says_with_its_margins(rig):
    spec, parts = TuningSpec(bandwidth_hz=13.0, gain_margin=1.2), PidParts()
    mode = driven_modes(rig)[0][1]
    delay_s = both_ways_s(rig.plant)
    gains = tuned_gains(mode, spec, parts, delay_s)
    found = pid_margins(mode, gains, parts, delay_s)

    assert gains.derivative > 0.0 and found.stable
    assert found.phase_rad == pytest.approx(spec.margin_rad, rel=2e-2)
    crossover_hz = found.phase_rad / found.delay_s / (2.0 * pi)
    assert crossover_hz == pytest.approx(13.0, rel=2e-2)


def test_a_bandwidth_out_of_reach_is_refused_with_the_one_that_is_not(drive):
    with pytest.raises(InputError, match=r"no PID crosses at 40 Hz .* for example \d"):
        tuned_pid(drive, TuningSpec(bandwidth_hz=40.0))


def test_the_network_takes_its_two_milliseconds_from_the_margin_of_delay(rig):
    gains, parts, mode = PAPER_GAINS["crr_rig"], PidParts(), driven_modes(rig)[0][1]
    law = law_of(gains, parts.derivative.filter(DT), DT)
    alone, there = (margins_of(mode, law, DT, d).delay_s for d in (0.0, both_ways_s(rig.plant)))

    assert alone - there == pytest.approx(2e-3, rel=1e-3)


def test_the_gains_of_the_papers_need_dry_friction_on_the_joint():
    """Paper 000: the same controllers are fine on the rig and oscillate on the joint."""
    parts = PidParts()
    stable = {}
    for name, gains in PAPER_GAINS.items():
        hybrid = axis_modes({"crr_rig": crr_rig, "crr_arm": crr_arm}[name]())
        modes = [side[1] for side in driven_modes(hybrid)]
        delay_s = both_ways_s(hybrid.plant)
        stable[name] = [pid_margins(mode, gains, parts, delay_s).stable for mode in modes]

    assert stable == {"crr_rig": [True, True], "crr_arm": [False, False]}


def follow(plant, pid, reference):
    name = plant.measured[0]
    record = close_loop(
        plant,
        pid,
        RawMeasurement(names=plant.measured, sample_time_s=DT),
        {name: reference},
        initial=consistent_start(plant, {name: reference[0]}),
        hardware=Hardware(converter_bits=24),
    )
    return record.recording[name]


def test_the_papers_gains_give_the_loop_that_the_papers_are_reproduced_with(rig):
    plant = crr_rig().lean()
    reference = 0.0762 + 0.01 * np.sin(2.0 * pi * DT * np.arange(300))
    ours = follow(plant, pid_with(rig, PAPER_GAINS["crr_rig"]), reference)
    other = tracked(plant, reference, (250.0, 200.0, 8.0))[plant.measured[0]]

    assert ours == pytest.approx(other, abs=1.5e-3)


def test_a_tuned_pid_with_feedforward_holds_a_sine_on_the_rig_that_the_papers_pid_does_not(rig):
    """1 Hz, 30 mm: measured 0.9 mm RMSE against 4.0 mm; the whole plant, 1 ms each way."""
    plant = crr_rig().lean()
    reference = 0.0762 + 0.03 * np.sin(2.0 * pi * DT * np.arange(1200))
    parts = PidParts(feedforward_share=1.0, setpoint_rate=1.0)
    pids = (
        tuned_pid(rig, TuningSpec(bandwidth_hz=5.0), parts),
        pid_with(rig, PAPER_GAINS["crr_rig"]),
    )
    tuned, papers = (
        np.sqrt(np.mean((follow(plant, pid, reference) - reference)[400:] ** 2)) for pid in pids
    )

    assert tuned < 1.2e-3 < 3e-3 < papers


def test_a_tuned_pid_with_feedforward_brings_the_drive_near_its_place_without_a_swing(drive):
    """Position alone, stiction and dead zone: it sticks 1.7 mm away (measured), and stays calm."""
    plant = servo_drive().lean()
    parts = PidParts(feedforward_share=1.0, setpoint_rate=1.0, turn_per_s=50.0, standing_per_s=50.0)
    pid = tuned_pid(drive, TuningSpec(bandwidth_hz=6.5, gain_margin=1.5), parts)
    t = np.clip((DT * np.arange(1500) - 0.1) / 0.5, 0.0, 1.0)
    reference = 0.115 + 0.06 * t**3 * (10.0 - 15.0 * t + 6.0 * t**2)
    position = follow(plant, pid, reference)

    assert abs(position[-300:] - 0.175).max() < 2.5e-3
    assert np.ptp(position[-300:]) < 0.2e-3


def test_the_arm_stays_in_its_range_under_a_pid_for_its_weak_spring():
    """The joint allows 0.7 Hz where the rig allows 6: its spring is three times softer."""
    plant = crr_arm()
    hybrid = axis_modes(plant)
    parts = replace(PidParts(), feedforward_share=1.0, turn_speed=0.1)
    pid = tuned_pid(hybrid, TuningSpec(bandwidth_hz=0.7), parts)
    reference = np.full(2500, radians(60.0))
    angle = follow(plant.lean(), pid, reference)

    assert np.degrees(abs(angle[-500:] - reference[-500:])).max() < 5.0
    with pytest.raises(InputError, match="no PID crosses at 6 Hz"):
        tuned_pid(hybrid, TuningSpec(bandwidth_hz=6.0), parts)

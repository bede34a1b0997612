"""Margins of the sampled loop at the plant's input: known loops, and the loops of the designs."""

from dataclasses import replace
from math import inf, pi

import numpy as np
import pytest
from commands import call
from slide_controllers import SLIDE_CONTROLLERS

from controllers.margins import (
    Law,
    both_ways_s,
    loop,
    margins,
    margins_of,
    unforeseen_s,
)
from controllers.positioning import STATES
from controllers.scheduled import driven_modes
from linearize.discrete import sampled
from linearize.reduction import design_model
from linearize.standard import standard_modes
from studies.design_text import margins_text
from workbench.contracts import Estimate
from workbench.effects.line_delay import SOUND_M_S
from workbench.plants.servo_drive import servo_drive

DT = 2e-3
everyone = pytest.mark.parametrize("name", SLIDE_CONTROLLERS)


@pytest.fixture(scope="module")
def hybrid():
    return standard_modes(servo_drive())


@pytest.fixture(scope="module")
def controllers(hybrid):
    return {name: m.design(hybrid, m.spec()) for name, m in SLIDE_CONTROLLERS.items()}


def proportional(gain):
    """U = -gain * position, without memory."""
    return Law(np.zeros((0, 0)), np.zeros((0, 4)), np.zeros(0), np.array([-gain, 0.0, 0.0, 0.0]))


def integrator(hybrid):
    """A mode whose position is the integral of its opening."""
    mode = driven_modes(hybrid)[0][1]
    A, B = np.diag([0.0, -1.0, -1.0, -1.0]), np.array([[1.0], [0.0], [0.0], [0.0]])
    return replace(mode, A=A, B=B, scale=np.ones(4), drift=np.zeros(4), state=np.zeros(4))


def test_a_sampled_integrator_has_the_margins_of_the_textbook(hybrid):
    """L = K T / (z - 1) has |L| = 1 at w T = 2 asin(K T / 2), and turns by -90 deg - w T / 2."""
    K = 100.0
    found = margins_of(integrator(hybrid), proportional(K), DT)
    turn = 2.0 * np.arcsin(K * DT / 2.0)

    assert found.stable
    assert found.gain == (0.0, pytest.approx(2.0 / (K * DT), rel=1e-6))
    assert found.phase_rad == pytest.approx(pi / 2.0 - turn / 2.0, rel=1e-9)
    assert found.delay_s == pytest.approx((pi / 2.0 - turn / 2.0) / (turn / DT), rel=1e-9)


@pytest.mark.parametrize("delay_s", [DT, 1.4 * DT, 3.0 * DT])
def test_a_delay_in_the_loop_takes_what_it_takes_from_the_phase(hybrid, delay_s):
    """L = K T / (z - 1) with u late by n T + r is K (T - r + r / z) / (z - 1) / z^n."""
    K, w = 40.0, np.geomspace(1.0, 1000.0, 50)
    A, B, C = loop(integrator(hybrid), proportional(K), DT, delay_s)
    n, z = int(delay_s / DT + 1e-9), np.exp(1j * w * DT)
    r = delay_s - n * DT
    expected = K * (DT - r + r / z) / (z - 1.0) / z**n
    got = [(C @ np.linalg.solve(each * np.eye(len(A)) - A, B))[0, 0] for each in z]

    assert np.allclose(got, expected)
    late, early = (
        margins_of(integrator(hybrid), proportional(K), DT, d).phase_rad for d in (delay_s, 0.0)
    )
    assert early - late == pytest.approx(K * delay_s, rel=0.02)


def test_the_delay_of_a_network_is_that_of_both_ways():
    from workbench.plants.crr_rig import crr_rig

    assert unforeseen_s(crr_rig()) == pytest.approx(1e-3)
    assert both_ways_s(crr_rig()) == pytest.approx(2e-3)


def test_a_line_delays_the_loop_as_a_network_does():
    """5 m of tube and 14.6 ms of network are the same to a loop, and both are told as left out."""
    drive = servo_drive()
    tube = drive.with_values({"line_delay.length_m": 5.0})
    network = drive.with_values({"command_delay.delay_s": 5.0 / SOUND_M_S})

    assert both_ways_s(tube) == pytest.approx(both_ways_s(network)) == 5.0 / SOUND_M_S
    assert "line_delay" in [each.what for each in design_model(tube).left_out]


@everyone
def test_gain_and_phase_margins_are_those_of_python_control(controllers, hybrid, name):
    """Of one mode: its crossings on an interpolated response, ours on the loop itself."""
    import control

    made = controllers[name]
    mode, law = driven_modes(hybrid)[0][1], made.laws.forward[1]
    found = margins_of(mode, law, made.sample_time_s)
    A, B, C = loop(mode, law, made.sample_time_s)
    omega = np.geomspace(0.1, pi / made.sample_time_s, 2000)
    values = control.ss(A, B, C, 0.0, made.sample_time_s)(np.exp(1j * omega * made.sample_time_s))
    response = control.frd(values, omega, smooth=True)
    gains, phases_deg, _, _, _, _ = control.stability_margins(response, returnall=True)
    ends = [*gains, *([-1.0 / values[-1].real] if values[-1].real < 0.0 else [])]

    assert found.gain[0] == pytest.approx(max((g for g in ends if g < 1.0), default=0.0), rel=1e-5)
    assert found.gain[1] == pytest.approx(min((g for g in ends if g > 1.0), default=inf), rel=1e-5)
    assert np.degrees(found.phase_rad) == pytest.approx(np.abs(phases_deg).min(), rel=1e-5)


def test_disk_margins_are_those_of_python_control(hybrid):
    import control

    K = 100.0
    found = margins_of(integrator(hybrid), proportional(K), DT)
    known = control.ss(1.0, DT, K, 0.0, DT)
    omega = np.geomspace(0.1, pi / DT * 0.999, 4000)
    size, gain_db, phase_deg = control.disk_margins(known, omega)

    assert found.disk == pytest.approx(size, rel=1e-3)
    assert found.disk_phase_rad == pytest.approx(np.radians(phase_deg), rel=1e-3)
    assert 20.0 * np.log10(found.disk_gain) == pytest.approx(gain_db, rel=1e-3)


def test_a_loop_beyond_its_gain_margin_is_called_unstable(hybrid):
    found = margins_of(integrator(hybrid), proportional(1001.0), DT)

    assert not found.stable
    said = margins_text([found]).splitlines()
    assert said[1].split()[-8:] == ["-"] * 7 + ["unstable"]
    assert said[2].startswith("unstable: ")


@everyone
def test_the_law_is_what_the_controller_does_near_its_point(controllers, hybrid, name):
    """Three samples of the controller itself, moved a little, against its linear law."""
    controller = controllers[name]
    law, place = controller.laws.forward[1], 0.145
    base = np.array([place, 0.1, 5.9e5, 5.0e5])
    moved = np.array([2e-5, 1e-3, 2e2, -1e2])

    def openings(change):
        command, found = controller.start(), []
        for _ in range(3):
            step_m = 0.1 * controller.sample_time_s  # as fast as the slide is
            reference = place + 1e-3 + step_m * np.arange(controller.preview)
            command = controller.step(command, reference[None], Estimate(STATES, base + change, 0))
            found.append(command.notes["opening_v"])
        return np.array(found)

    s, expected = np.zeros(len(law.A)), []
    for _ in range(3):
        expected.append(law.C @ s + law.D @ moved)
        s = law.A @ s + law.B @ moved

    assert openings(moved) - openings(0.0 * moved) == pytest.approx(expected, rel=0.05, abs=1e-4)


@everyone
def test_gain_margins_are_where_the_loop_changes_its_stability(controllers, hybrid, name):
    controller = controllers[name]
    modes = [mode for side in driven_modes(hybrid) for mode in side]
    laws = controller.laws.forward + controller.laws.backward
    for found, mode, law in zip(margins(hybrid, controller.laws, DT), modes, laws, strict=True):
        A, B, C = loop(mode, law, DT)

        def radius(gain, A=A, B=B, C=C):
            return np.abs(np.linalg.eigvals(A - gain * B @ C)).max()

        assert found.stable == (radius(1.0) < 1.0)
        for end in {*found.gain} - {0.0, inf}:
            assert radius(0.99 * end) < 1.0 < radius(1.01 * end)


def test_lq_and_mpc_bear_half_the_gain_and_more_and_30_degrees(controllers, hybrid):
    """PID does not: without the pressures it leaves the spring at 5 deg, but it is stable."""
    for name in ("lq", "mpc"):
        for found in margins(hybrid, controllers[name].laws, DT):
            assert found.stable
            assert found.gain[0] < 0.5 and found.gain[1] > 2.0
            assert found.phase_rad > pi / 6.0 and found.delay_s > DT
            assert found.distance > 0.5
    pid = controllers["pid"]
    for found in margins(hybrid, pid.laws, pid.sample_time_s):
        assert found.stable and found.gain[1] > 1.9 and found.phase_rad > pi / 60.0


def test_the_loop_of_a_mode_is_the_sampled_mode_behind_its_law(hybrid):
    mode = driven_modes(hybrid)[0][1]
    A, B, C = loop(mode, proportional(2.0), DT)
    small = sampled(mode, DT)

    assert np.allclose(A * mode.scale[:, None] / mode.scale, small.F)
    assert np.allclose(B[:, 0] * mode.scale, small.G[:, 0])
    assert (C / mode.scale)[0] == pytest.approx([2.0, 0.0, 0.0, 0.0])


@everyone
def test_design_prints_margins_of_every_mode_and_what_is_certified_across_them(tmp_path, name):
    rig = tmp_path / "rig.toml"
    rig.write_text('plant = "servo_drive"\n')

    answer = call("design", rig, "--controller", name, "-o", tmp_path / "design.toml", "-q")

    assert answer.exit_code == 0, answer.output
    if name == "nonlinear-mpc":  # its law is the model itself, not one for each mode
        assert "no margins" in answer.stdout and "Lyapunov" not in answer.stdout
        return
    lines = answer.stdout.splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("mode "))
    assert all(word in lines[head] for word in ("gain up to", "phase deg", "delay ms", "distance"))
    assert len({line.split("  ")[0] for line in lines[head + 1 : head + 7]}) == 6
    certified = "one quadratic Lyapunov function" in answer.stdout
    assert certified == (name != "pid")
    assert "unstable" not in answer.stdout

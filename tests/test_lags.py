"""Lags of spool and sensor in margins and tuning: the modes leave them out, the loops do not."""

from dataclasses import replace

import control
import numpy as np
import pytest
from commands import call

from controllers.design_file import design
from controllers.foresight import delays_of
from controllers.lags import Lag, behind_lags, lags_of, measured_lags, spool_lag, unread
from controllers.margins import Law, both_ways_s, loop, margins_of
from controllers.pid_tuning import PidParts, TuningSpec, pid_margins, tuned_pid
from controllers.scheduled import driven_modes
from controllers.through_valve import LED_S
from linearize.standard import axis_modes, standard_modes
from studies.design_report import design_report
from workbench.plants.crr_rig import crr_rig
from workbench.plants.servo_drive import servo_drive

DT = 1e-3
SLOW_S = 15e-3
SLOW = Lag("spool", SLOW_S)


@pytest.fixture(scope="module")
def slow():
    return servo_drive().with_values({"valve_lag.time_constant_s": SLOW_S})


@pytest.fixture(scope="module")
def hybrid(slow):
    return standard_modes(slow)


@pytest.fixture(scope="module")
def mode(hybrid):
    return driven_modes(hybrid)[0][1]


def proportional(gain):
    empty = np.zeros((0, 4))
    return Law(np.zeros((0, 0)), empty, np.zeros(0), np.array([-gain, 0.0, 0.0, 0.0]))


def test_the_loop_with_a_spool_is_that_of_python_control(hybrid, mode):
    """Lag and mode in series by another package, held openings: the same L(z)."""
    lagging = driven_modes(behind_lags(hybrid, [SLOW]))[0][1]
    A, B, C = loop(lagging, unread(proportional(30.0)), DT)
    lag = control.ss(-1.0 / SLOW_S, 1.0 / SLOW_S, 1.0, 0.0)
    place = control.ss(mode.A, mode.B, np.eye(4)[:1], 0.0)
    whole = control.c2d(control.series(lag, place), DT, "zoh")
    z = np.exp(1j * DT * np.geomspace(1.0, 3000.0, 40))
    found = control.ss(A, B, C, 0.0, DT)(z)

    assert found == pytest.approx(30.0 * whole(z), rel=1e-6)


def test_a_spool_takes_its_phase_from_the_margin(hybrid, mode):
    """At a crossover w a first-order lag turns the loop by atan(w T)."""
    lagging = driven_modes(behind_lags(hybrid, [Lag("spool", 1e-3)]))[0][1]
    fast = margins_of(mode, proportional(10.0), DT)
    slow = margins_of(lagging, unread(proportional(10.0)), DT)
    crossing = fast.phase_rad / fast.delay_s

    assert fast.phase_rad - slow.phase_rad == pytest.approx(np.arctan(1e-3 * crossing), rel=0.02)


def test_without_a_lag_nothing_stands_before_the_modes():
    plant = servo_drive()
    hybrid = standard_modes(plant)

    assert spool_lag(plant, told=True) == measured_lags(plant, plant.measured[0]) == ()
    assert behind_lags(hybrid, []) is hybrid


def test_a_spool_is_led_where_an_estimator_tells_of_it_and_only_there(slow):
    """A PID on the measurement meets the whole lag, an LQ behind a filter what leading leaves."""
    lags = {m: delays_of(slow, design(m, slow).controller).lags for m in ("axis-pid", "lq")}
    fast = slow.with_values({"valve_lag.time_constant_s": 2e-3})

    assert lags == {"axis-pid": (SLOW,), "lq": (Lag("spool", LED_S),)}
    assert spool_lag(fast, told=True) == (Lag("spool", 2e-3),)


def test_the_lag_of_a_sensor_is_in_the_loop_of_a_law_on_that_sensor_alone(slow):
    """Estimators know it: an LQ behind one does not meet it, nor a PID that of a pressure."""
    place, pressure = "slide.position", "chamber_a.pressure"
    late_s = {place: 20e-3, pressure: 10e-3}
    both = slow.with_values({f"sensor_lag@{k}.time_constant_s": v for k, v in late_s.items()})
    pid, lq = (design(method, both).controller for method in ("axis-pid", "lq"))

    assert lags_of(both, pid) == (SLOW, Lag("sensor", 20e-3))
    assert lags_of(both, lq) == (Lag("spool", LED_S),)


@pytest.mark.parametrize("method", [pytest.param("axis-pid", marks=pytest.mark.slow), "lq"])
def test_margins_certificate_and_filter_of_a_design_have_the_lag(slow, method):
    """They were those of the drive without it, though the reduction had said they hold it."""
    found = design(method, slow)
    told = design_report(found, lambda said: None).laws[0]
    blind = replace(found, plant=servo_drive())
    without = design_report(blind, lambda said: None).laws[0]

    for ours, theirs in zip(told.margins, without.margins, strict=True):
        assert ours.stable and ours.delay_s < theirs.delay_s
    for ours, theirs in zip(told.filtered, without.filtered, strict=True):
        assert ours.phase_rad < theirs.phase_rad
    assert len(told.filtered) == len(without.filtered) == (6 if method == "lq" else 0)


def test_gains_are_tuned_with_the_spool_in_the_loop():
    """Those for a fast spool lack their margin of phase behind a slow one."""
    spec, parts = TuningSpec(bandwidth_hz=5.0), PidParts()
    late = crr_rig().with_values({"valve_lag.time_constant_s": SLOW_S})
    lagging = driven_modes(behind_lags(axis_modes(late), [SLOW]))
    delay_s = both_ways_s(late)

    def least(plant):
        pid = tuned_pid(axis_modes(plant), spec, parts)
        pairs = zip(lagging, (pid.gains.forward, pid.gains.backward), strict=True)
        both = (pair for modes, side in pairs for pair in zip(modes, side, strict=True))
        return min(pid_margins(*each, parts, delay_s).phase_rad for each in both)

    assert least(late) >= 0.99 * spec.margin_rad
    assert least(crr_rig()) < 0.8 * spec.margin_rad


def test_design_says_that_a_spool_is_in_the_loop(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text('plant = "servo_drive"\n[values]\n"valve_lag.time_constant" = "15 ms"\n')
    answer = call("design", path, "--controller", "lq", "-o", tmp_path / "design.toml", "-q")

    assert answer.exit_code == 0, answer.output
    assert "a lag of 4 ms of the spool, led by what an estimator tells of it" in answer.stdout

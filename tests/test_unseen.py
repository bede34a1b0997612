"""A controller that sees nothing: what every one of the registry does, and how long it waits."""

from dataclasses import replace

import numpy as np
import pytest

from controllers import CONTROLLERS
from controllers.design_file import PLANTS, design
from controllers.unseen import HELD_S, Unseen
from linearize.standard import SHIFT_MODES
from workbench.contracts import Estimate
from workbench.filtering import consistent_start
from workbench.plants import PLANTS as MADE

SAMPLES = 4
everyone = pytest.mark.parametrize("method", CONTROLLERS)


def begun(method):
    """A controller, the lean plant, an estimate of its start, and the reference: a little ahead."""
    plant = MADE[next(iter(PLANTS[CONTROLLERS[method].modes]))]()
    found, lean = design(method, plant), plant.lean()
    names = lean.model.states
    state = consistent_start(lean, {})
    seen = Estimate(tuple(names), np.array(state), np.diag(np.array(lean.scale) ** 2) * 1e-8)
    axes = [name for name in names if name.endswith(("position_m", "angle_rad"))] or [names[0]]
    places = np.array([seen.pick([name])[0] for name in axes])
    away = 0.0 if lean.name in SHIFT_MODES else 1e-3  # a gearbox has places of its own
    reference = np.tile(1.02 * places[:, None] + away, (1, found.controller.preview))
    return found.controller, lean, seen, reference


def in_range(plant, command):
    pairs = zip(plant.commands, command.value, strict=True)
    return all(signal.lower <= value <= signal.upper for signal, value in pairs)


@everyone
@pytest.mark.parametrize("at_once", [True, False], ids=["from the start", "later"])
def test_a_lost_estimate_sends_a_command_of_the_valve_and_the_loop_goes_on(method, at_once):
    """NaN had ended six of them, and was full exhaust for feedback linearisation."""
    controller, plant, seen, reference = begun(method)
    lost = replace(seen, state=np.full(len(seen.state), np.nan))
    command = controller.start()
    for _ in range(0 if at_once else SAMPLES):
        command = controller.step(command, reference, seen)
    for _ in range(SAMPLES):
        command = controller.step(command, reference, lost)

        assert in_range(plant, command) and command.notes["fallback"] == 1.0
    after = controller.step(command, reference, seen)

    assert in_range(plant, after) and not after.notes.get("fallback")


def held(controller, last, reference, lost, samples):
    for _ in range(samples):
        last = controller.step(last, reference, lost)
    return last


@pytest.mark.parametrize("method", ["lq", "mpc", "axis-pid", "feedback-linearisation"])
def test_the_last_command_holds_for_a_few_samples_and_then_the_valve_shuts(method):
    controller, _, seen, reference = begun(method)
    before = controller.step(controller.start(), reference + 0.05, seen)
    lost = replace(seen, state=np.full(len(seen.state), np.nan))
    few = round(HELD_S / controller.sample_time_s)

    assert held(controller, before, reference, lost, few).value == pytest.approx(before.value)
    shut = held(controller, before, reference, lost, few + 1)
    assert shut.value == pytest.approx(controller.start().value)
    assert before.value != pytest.approx(shut.value)
    assert shut.memory == Unseen(before.memory, few + 1)


def test_a_position_controller_does_not_miss_a_pressure_that_it_never_reads():
    controller, _, seen, reference = begun("axis-pid")
    state = np.where([name.endswith("_pa") for name in seen.names], np.nan, seen.state)
    start = controller.start()
    without = controller.step(start, reference, replace(seen, state=state))

    assert without.value == pytest.approx(controller.step(start, reference, seen).value)
    assert "fallback" not in without.notes

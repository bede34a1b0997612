"""Hybrid MPC of the gearbox at an end that was met: at rest, and bouncing off it."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from test_hybrid_mpc import seen, to

from controllers.design_file import design
from controllers.hybrid_mpc import HybridMpc, ShiftMemory
from controllers.shift_prediction import query
from linearize.shifting import POSITION
from studies.shift_check import NOISE, SAMPLE_TIME_S, impact_m_s, shift_filter
from workbench.closed_loop import Hardware, close_loop
from workbench.contracts import Command
from workbench.filtering import consistent_start
from workbench.plants.gearbox import FINGER_M, FLOATING, gearbox

AIR_PA = 1.013e5


@pytest.fixture(scope="module")
def made():
    return design("hybrid-mpc", gearbox()).controller


@pytest.mark.parametrize("end_m", [-12e-3, 12e-3])
def test_at_rest_at_an_end_nothing_switches(made, end_m):
    """Within the noise of its sensor a piston at its end is not on its way there."""
    command, random = made.start(), np.random.default_rng(2)
    for _ in range(60):
        x = [1.013e5, 1.013e5, end_m - np.sign(end_m) * 1e-6, 0.0]
        noise = random.standard_normal(4) * [0.0, 0.0, 2e-5, 0.0]
        command = made.step(command, to(end_m), seen(x + noise))

    assert command.memory.met and command.memory.sent == (0, 0)


def test_an_end_that_was_met_is_not_on_its_way_again_when_the_piston_bounces(made):
    command = made.step(made.start(), to(12e-3), seen([4e5, 2e5, 11e-3, 1.0]))
    assert not command.memory.met
    command = made.step(command, to(12e-3), seen([4e5, 2e5, 12e-3, 0.2]))
    bounced = made.step(command, to(12e-3), seen([4e5, 2e5, 11.5e-3, -0.2]))

    assert bounced.memory.met
    assert query(12e-3, 0.0, 11.5e-3, bounced.memory.met)[3] == 0.0
    assert query(12e-3, 0.0, 11.5e-3)[3] == pytest.approx(0.5e-3)
    turned = made.step(bounced, to(0.0), seen([4e5, 2e5, 11.5e-3, -0.2]))
    assert not turned.memory.met
    assert query(0.0, 12e-3, 1e-3, met=True)[3] == query(0.0, 12e-3, 1e-3)[3] > 0.0


def rested(made, end_m):
    """The last command of a piston that has come to rest at an end."""
    command = made.start()
    for _ in range(30):
        command = made.step(command, to(end_m), seen([AIR_PA, AIR_PA, end_m, 0.0]))
    assert command.memory.met and command.memory.sent == (0, 0)
    return command


@pytest.mark.parametrize(
    ("end_m", "off_m", "speed_m_s", "over_pa", "switched"),
    [
        (12e-3, 0.7e-3, 0.06, (5.1e4, 0.9e4), (1, 0)),
        (-12e-3, 0.6e-3, -0.1, (2.0e4, 4.9e4), (0, 1)),
    ],
)
def test_a_piston_that_comes_back_by_itself_is_left_alone(
    made, end_m, off_m, speed_m_s, over_pa, switched
):
    """The same estimate of a piston that has not met its end yet is worth a switch."""
    resting = rested(made, end_m)
    pressures = (AIR_PA + over for over in over_pa)
    bouncing = seen([*pressures, end_m - np.sign(end_m) * off_m, speed_m_s])
    on_its_way = replace(resting, memory=replace(resting.memory, met=False))

    assert made.step(resting, to(end_m), bouncing).memory.sent == (0, 0)
    assert made.step(on_its_way, to(end_m), bouncing).memory.sent == switched


@dataclass(frozen=True)
class Resumed:
    """A controller that goes on from a memory."""

    inner: HybridMpc
    memory: ShiftMemory
    preview: int = 1

    @property
    def sample_time_s(self):
        return self.inner.sample_time_s

    def start(self):
        return Command(np.zeros(2), self.memory)

    def step(self, last, reference, estimate):
        return self.inner.step(last, reference, estimate)


@pytest.mark.parametrize("end_m", [-12e-3, 12e-3])
def test_a_piston_that_is_pushed_off_its_end_comes_back_as_softly_as_on_a_shift(made, end_m):
    """Found by a review: as one that bounces it was driven back at full, into the stop."""
    memory, plant = rested(made, end_m).memory, gearbox().lean()
    place_m = end_m - np.sign(end_m) * 8e-3
    places = {
        POSITION: place_m,
        f"{FLOATING}.position_m": max(place_m, 0.0),
        "finger.angle_rad": place_m / FINGER_M,
    }
    record = close_loop(
        plant,
        Resumed(made, memory),
        shift_filter(plant, made.sample_time_s),
        {POSITION: np.full(480, end_m)},
        initial=consistent_start(plant, places),
        hardware=Hardware(noise=NOISE),
        sample_time_s=SAMPLE_TIME_S,
        seed=1,
    )

    assert abs(record.recording[POSITION][-1] - end_m) < 0.3e-3
    assert impact_m_s(record, 12e-3) < 1.0  # 1.9 and 1.7 at full drive

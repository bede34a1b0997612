"""Hybrid MPC of the gearbox at an end that was met: at rest, and bouncing off it."""

import numpy as np
import pytest
from test_hybrid_mpc import seen, to

from controllers.design_file import design
from controllers.shift_prediction import query
from workbench.plants.gearbox import gearbox


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

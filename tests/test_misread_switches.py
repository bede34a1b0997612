"""Switched commands that a rig file reads the wrong way round."""

from dataclasses import replace

import numpy as np
import pytest
from driven_gearbox import DRIVEN

from studies import adversarial as spoil
from workbench.comparison.run import simulate
from workbench.consistency import Weight, examined
from workbench.rig import default_rig

NOISE = {"pressure_pa": 300.0, "position_m": 2e-5}


@pytest.fixture(scope="module")
def gearbox():
    """The gearbox's rig and what it records of the manoeuvre, with noise."""
    rig, rng = default_rig("gearbox"), np.random.default_rng(4)
    made = simulate(rig, DRIVEN)
    sigma = {name: NOISE.get(name.rpartition(".")[2], 0.0) for name in made.channels}
    rows = {k: v + sigma[k] * rng.standard_normal(len(v)) for k, v in made.channels.items()}
    return rig, replace(made, channels=rows)


def test_nothing_is_said_of_valves_that_are_read_aright(gearbox):
    assert examined(*gearbox) == ()


@pytest.mark.parametrize("valve", ["valve_1.command", "valve_2.command"])
def test_an_inverted_valve_is_told_with_its_own_levels_and_is_no_unit(gearbox, valve):
    """It rests at 0 and switches to 1: inverted it is 1 minus the command, not minus it."""
    rig, recording = gearbox
    (found,) = examined(rig, spoil.turned(valve, 0.5)(recording))

    assert (found.weight, found.channel) == (Weight.REFUSED, valve)
    assert found.what.startswith("seems to act the other way; ")
    assert found.remedy.startswith("1 minus the recorded command")

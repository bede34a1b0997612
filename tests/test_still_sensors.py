"""Sensors that stand still: coarse ones are told where the plant moves; no clock seems uneven."""

# ruff: noqa: F811  (fixtures of other tests)

from dataclasses import replace

import numpy as np
import pytest
from test_adversarial_recordings import PLACE, A, demo, said  # noqa: F401

from studies import adversarial as spoil
from workbench.consistency import Weight, trusted
from workbench.recording import Recording
from workbench.rig import default_rig


@pytest.mark.parametrize(("name", "step"), [(PLACE, 2e-4), (A, 2e3)])
def test_a_coarse_sensor_that_stands_still_while_the_plant_moves_is_told(demo, name, step):
    """It repeats values anyway, and the plant may rest there: its samples are kept."""
    rig, train, _ = demo
    coarse = replace(train, channels={**train.channels, name: step * np.round(train[name] / step)})
    ((kept,),), findings = trusted(rig, [spoil.stuck(name, 3.0)(coarse)])
    (finding,) = (each for each in findings if "stands at" in each.what)

    assert said(rig, coarse) == []
    assert finding.weight is Weight.NOTICE and "to 9.999 s, while the plant" in finding.what
    assert np.isfinite(kept[name]).all()


def test_a_sensor_that_sticks_makes_no_clock_uneven():
    """The bare chamber stands still as its sensor does, and noise ends where it begins to."""
    t = 0.1 * np.arange(1400)
    pressure = 8e5 * np.exp(-t / 200.0) + 200.0 * np.random.default_rng(0).standard_normal(1400)
    pressure[400:] = pressure[400]
    stood = Recording("stood", 0.1, {"chamber.pressure_pa": pressure})

    assert said(default_rig("closed_chamber"), stood) == []

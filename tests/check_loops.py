"""Loops of a check that take no time: their figures follow from the plant that was drawn."""

from types import SimpleNamespace

import numpy as np

from studies.closed_loop_check import Check
from studies.closed_loop_metrics import Metrics
from workbench.recording import Recording
from workbench.rig import default_rig

RIG = default_rig("servo_drive")
SPEC = 'rise_time = "150 ms"\nair = "2 g"\n[limits]\nchamber_a.pressure = ["1.2 bar", "7 bar"]\n'
MASS = "slide.mass_kg"


def metrics(**figures):
    """Of a step that reaches the goal, but for these figures."""
    good = dict.fromkeys(vars(Metrics("", "", "", *[0.0] * 13)), 0.0)
    labels = dict(design="lq", estimator="ekf", scenario="step", amplitude_m=float("nan"))
    return Metrics(**{**good, **labels, **figures})


def record(pressure_pa=2e5):
    """A run in which this pressure stood."""
    channels = {"chamber_a.pressure_pa": np.full(3, pressure_pa)}
    return SimpleNamespace(recording=Recording("run", 1e-3, channels))


def heavy_is_slow(loops, plant, seed):
    """A loop whose rise takes longer with a heavier slide; 150 ms at half a deviation."""
    off = (plant.values[MASS] / RIG.plant.values[MASS] - 1.0) / 0.05
    return Check((metrics(rise_s=0.145 + 0.01 * off),), (record(),))

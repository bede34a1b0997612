"""Eight kicks of a vertical cylinder.

Source: github jefersonjlima/wbident, commit c33319be; MIT, Copyright (c) the wbident authors.
One file of 10 s at 1 kHz.  Each kick begins where the sinking rod turns, with the position recorded
there and no velocity, and ends where the next one begins.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from workbench.reading import read_recording
from workbench.recording import Recording
from workbench.rig import Rig, load_rig

RIG = Path(__file__).with_name("vertical_cylinder.toml")
FILE = Path("vertical_cylinder") / "kicks.mat"
TRAIN = slice(0, 4)
TEST = slice(4, 8)
ALIKE = slice(0, 4, 2)  # of those for training: the others fall 20 % slower
THRESHOLD_PA = 1.5e5  # absolute: a kick passes it upwards
TURN_S = 0.06  # the rod turns within this time after the threshold


def rig() -> Rig:
    """The bare cylinder."""
    return load_rig(RIG)


def everything(folder: Path) -> list[tuple[Rig, Recording]]:
    """Every kick, with the cylinder."""
    return [(rig(), kick) for kick in kicks(folder)]


def kicks(folder: Path) -> list[Recording]:
    """The kicks, each with its own start: ``TRAIN`` for fitting, ``TEST`` for validation."""
    whole = read_recording(rig(), folder / FILE)
    starts = turning_points(whole)
    return [
        replace(whole.part(first, last), name=f"kick {number}")
        for number, (first, last) in enumerate(pairwise(starts), start=1)
    ]


def turning_points(whole: Recording) -> list[int]:
    """The sample at which the rod turns, for each kick: the middle of its lowest stretch."""
    pressed = whole["chamber.pressure_pa"] > THRESHOLD_PA
    rises = np.flatnonzero(pressed[1:] & ~pressed[:-1])
    within = round(TURN_S / whole.sample_time_s)
    found = []
    for rise in rises:
        position_m = whole["rod.position_m"][rise : rise + within]
        lowest = np.flatnonzero(position_m <= position_m.min() + 1e-9)
        found.append(int(rise + lowest[len(lowest) // 2]))
    return found

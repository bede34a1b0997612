"""Friction of a small printed cylinder with three kinds of seal at four pressures.

Source: github EvaZillen/3D-printed-pneumatic-actuator, commit 6e0bcb46, TU Delft thesis; CC0 1.0.
Ten slow strokes of about 15 mm/s per file at about 100 Hz; the stamps jitter by a millisecond and
have gaps, at which the recordings are cut.
"""

from __future__ import annotations

from dataclasses import replace
from math import pi
from pathlib import Path

from workbench.reading import read_recording
from workbench.recording import Recording
from workbench.rig import Rig, load_rig

SEALS = ("O-ring257", "KDN", "X-ring257")
TRAIN_BAR = (1, 3, 7)
HELD_OUT_BAR = (5,)
RIG = Path(__file__).with_name("printed_cylinder.toml")
BORE_M = 25e-3  # of the files without 257 in their name


def rig(seal: str) -> Rig:
    """The bench with this seal's bore."""
    bench = load_rig(RIG)
    plant = bench.plant
    if "257" not in seal:
        plant = plant.with_values({"chamber.area_m2": pi / 4 * BORE_M**2})
    return replace(bench, name=f"printed cylinder, {seal}", plant=plant)


def everything(folder: Path) -> list[tuple[Rig, Recording]]:
    """Every recording, with its bench."""
    levels_bar = sorted(TRAIN_BAR + HELD_OUT_BAR)
    return [(rig(s), each) for s in SEALS for each in recordings(folder, s, tuple(levels_bar))]


def recordings(folder: Path, seal: str, levels_bar: tuple[int, ...]) -> list[Recording]:
    """The recordings of one seal at these pressures."""
    bench, place = rig(seal), folder / "printed_cylinder"
    return [read_recording(bench, place / f"{seal}_{level}bar.csv") for level in levels_bar]

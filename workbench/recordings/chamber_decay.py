"""Pressure decay of two closed chambers, one turned from aluminium and one printed.

Source: github EvaZillen/3D-printed-pneumatic-actuator, commit 6e0bcb46, TU Delft thesis; CC0 1.0.
About 140 s at 10 Hz each.  Within that time cooling and leakage cannot be told apart: the pressure
falls by a tenth of a bar or less either way.
"""

from __future__ import annotations

from pathlib import Path

from workbench.reading import read_recording
from workbench.recording import Recording
from workbench.rig import Rig, load_rig

RIG = Path(__file__).with_name("chamber_decay.toml")
FOLDER = Path("printed_cylinder") / "chamber_decay"
CHAMBERS = ("Aluminium", "Ultimaker_006")
TRAIN_SHARE = 0.6


def rig() -> Rig:
    """The bare chamber."""
    return load_rig(RIG)


def everything(folder: Path) -> list[tuple[Rig, Recording]]:
    """Every decay, with its bench."""
    return [(rig(), decay(folder, chamber)) for chamber in CHAMBERS]


def recordings(folder: Path, chamber: str) -> tuple[Recording, Recording]:
    """The first 60 % of one chamber's decay, for fitting, and the rest."""
    whole = decay(folder, chamber)
    cut = round(TRAIN_SHARE * len(whole))
    return whole.part(0, cut), whole.part(cut, len(whole))


def decay(folder: Path, chamber: str) -> Recording:
    """The decay of one chamber.

    The clock stumbles once in the first seconds; the long piece behind that is taken.
    """
    return max(read_recording(rig(), folder / FOLDER / f"{chamber}.csv").pieces, key=len)

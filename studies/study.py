"""What a study is: a question, what it runs, and what came out beside what is claimed.

A new study is one file and one line in ``studies/registry.py``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure


NUMBERS, TEXT = "study.json", "study.txt"  # in the folder of a study that has run


class Extent(Enum):
    """How much of a study is run: a grid of minutes, or all of it, which may take hours."""

    QUICK = "quick"
    FULL = "full"


@dataclass(frozen=True)
class Claim:
    """What is claimed, what was found, and whether it holds."""

    claim: str
    found: str
    holds: bool


@dataclass(frozen=True)
class Outcome:
    """What a study gives: a text, its claims, figures by file name, and numbers for JSON."""

    text: str
    claims: tuple[Claim, ...]
    figures: Mapping[str, Figure]
    numbers: Mapping[str, Any]


@dataclass(frozen=True)
class Study:
    """One study.

    Attributes
    ----------
    name
        As typed behind ``workbench study``.
    question
        What it asks, in one line.
    source
        Paper and experiment, or the design document that asks for it.
    run
        (folder for what must survive a kill, extent, progress) -> outcome.
    rows
        Experiments of the papers that it reproduces, as physics.md section 5 numbers them.
    plants
        Those whose parameters its report prints.
    seeds
        Of whatever it draws, in words.
    """

    name: str
    question: str
    source: str
    run: Callable[[Path, Extent, Callable[[str], None]], Outcome]
    rows: tuple[str, ...] = ()
    plants: tuple[str, ...] = ()
    seeds: str = ""

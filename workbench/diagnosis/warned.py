"""A warning, and whether it is said of the recordings or of the model of one round.

Where rounds follow each other recordings stay as they are, and so does what is said of them; what
is said of a model is to be asked again with another effect added.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto


class Of(Enum):
    """What a warning is said of."""

    RECORDINGS = auto()
    MODEL = auto()
    ERRORS_LEFT = auto()  # by the model: what the next round is for


@dataclass(frozen=True)
class Warned:
    """One warning in words."""

    text: str
    of: Of = Of.RECORDINGS

    def __str__(self) -> str:
        return self.text

"""A case of any plant's truth: what is hidden, how large, and the small differences beside it."""

import zlib
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Hidden:
    """One effect that the detector has to find: its field, typical size, how it acts.

    `signed`: the sign is drawn too. `replaces`: the size stands instead of the nominal value.
    """

    fields: tuple[str, ...]
    typical: float
    signed: bool = False
    replaces: bool = False

    def drawn_size(self, smallest: float, largest: float, rng: np.random.Generator) -> float:
        """Log-uniform between two shares of typical, with a sign where that is drawn too."""
        share = np.exp(rng.uniform(np.log(smallest), np.log(largest)))
        return float(self.typical * share * (rng.choice([-1, 1]) if self.signed else 1))


@dataclass(frozen=True)
class Difference:
    """One small deviation of the truth from the detector's model: field = nominal + change."""

    field: str
    change: float


@dataclass(frozen=True)
class Case:
    """All drawn numbers of one recording pair.

    `size` is the hidden size in SI, 0 if nothing is hidden.
    `accessories` are fields without effect of their own (wavelength, phase, valve damping, ...).
    `shrunk` maps a field to the factor by which the misfit rule has reduced its difference.
    """

    hidden: str | None
    seed: int
    size: float
    differences: tuple[Difference, ...]
    accessories: tuple[tuple[str, float], ...]
    shrunk: tuple[tuple[str, float], ...] = ()
    redraws: int = 0
    plant: str = "servo_drive"

    @property
    def supply_recorded(self) -> bool:
        """False if the supply pressure is not among the channels."""
        return self.hidden != "supply_droop"


def generator(hidden: str | None, seed: int, purpose: str) -> np.random.Generator:
    """Random numbers that depend on case and purpose only, not on the batch."""
    return np.random.default_rng([seed, zlib.crc32(f"{hidden}/{purpose}".encode())])


def resized(case: Case, size: float) -> Case:
    """The same case with another hidden size (counts as a redraw)."""
    return replace(case, size=size, redraws=case.redraws + 1)


def shrink(case: Case, factors: dict[str, float]) -> Case:
    """The case with some differences multiplied by factors, which are noted in `shrunk`."""
    differences = tuple(
        Difference(x.field, x.change * factors.get(x.field, 1.0)) for x in case.differences
    )
    noted = dict(case.shrunk)
    for field, factor in factors.items():
        noted[field] = noted.get(field, 1.0) * factor
    return replace(case, differences=differences, shrunk=tuple(sorted(noted.items())))

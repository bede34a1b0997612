"""A case of any plant's truth: what is hidden, how large, and the small differences beside it."""

import zlib
from collections.abc import Container, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

SMALLEST_SHARE, LARGEST_SHARE = 0.10, 0.60  # of the typical size
SMALLEST_OUTSIDE = 0.30  # of a law outside the catalogue
TANK_M3 = 1e-3  # behind a supply that droops


@dataclass(frozen=True)
class Hidden:
    """One effect that the detector has to find: its fields and typical size.

    The size stands instead of the nominal value. `signed`: the sign is drawn too.
    """

    fields: tuple[str, ...]
    typical: float
    signed: bool = False

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


def require_known(hidden: str | None, effects: Mapping[str, Hidden]) -> None:
    """Raise KeyError for an effect that is none of a plant's."""
    if hidden is not None and hidden not in effects:
        raise KeyError(f"truth: {hidden} is not a hidden effect; there are {', '.join(effects)}")


def drawn_size(
    effects: Mapping[str, Hidden],
    outside: Container[str],
    hidden: str | None,
    rng: np.random.Generator,
    smallest: float = SMALLEST_SHARE,
) -> float:
    """Log-uniform in 10..60 % of typical; a law outside the catalogue gets the upper half."""
    if hidden is None:
        return 0.0
    low = SMALLEST_OUTSIDE if hidden in outside else smallest
    return effects[hidden].drawn_size(low, LARGEST_SHARE, rng)


def differences_of(
    change: Mapping[str, float], effects: Mapping[str, Hidden], hidden: str | None
) -> tuple[Difference, ...]:
    """Changes by field; a field whose size is the hidden one keeps exactly that size."""
    own = effects[hidden].fields if hidden else ()
    return tuple(Difference(f, float(c)) for f, c in change.items() if f not in own)


def true_fields(
    case: Case, nominal: Any, effects: Mapping[str, Hidden], without: str = ""
) -> dict[str, float]:
    """Fields in which the true plant differs from the nominal one.

    `without` names a field whose difference is off, or "hidden".
    """
    changes = dict(case.accessories)
    for difference in case.differences:
        if difference.field != without:
            changes[difference.field] = getattr(nominal, difference.field) + difference.change
    if case.hidden:
        size = 0.0 if without == "hidden" else case.size
        changes.update(hidden_fields(effects, case.hidden, size))
    return changes


def hidden_fields(effects: Mapping[str, Hidden], hidden: str, size: float) -> dict[str, float]:
    """Fields of a hidden effect of this size."""
    if hidden == "supply_droop":  # no droop is an infinite tank; a resistance of 0 divides
        return {"supply_resistance_pa_s_kg": size, "tank_per_m3": 1 / TANK_M3} if size else {}
    return {field: size for field in effects[hidden].fields}


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

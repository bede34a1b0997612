"""Which parameters a fit may move, and what is believed of them before it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from workbench.candidate import Candidate
from workbench.plant import Plant

WIDE = 1e3  # prior deviations of an added cause, in typical sizes: bounds alone hold it


@dataclass(frozen=True)
class Unknowns:
    """Free parameters with their prior, bounds and steps for differences; each array (n_p,).

    A fit moves t = (value - prior) / scale.  ``precision`` is the prior's weight on t**2, 1 for a
    parameter with a prior and nearly 0 for an added cause.  ``held`` are values that stay as they
    are but differ from the plant's.  ``reach`` is how many prior deviations what has a prior may
    go: one number, or (n_p,).
    """

    names: tuple[str, ...]
    prior: np.ndarray
    scale: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    precision: np.ndarray
    held: Mapping[str, float] = field(default_factory=dict)
    reach: float | np.ndarray = np.inf

    def __len__(self) -> int:
        return len(self.names)

    @property
    def with_prior(self) -> np.ndarray:
        """True for what a prior holds, not for what was added, shape (n_p,)."""
        return self.precision >= 1.0

    @property
    def ends(self) -> tuple[np.ndarray, np.ndarray]:
        """Smallest and largest scaled unknowns: bounds, or ends of the reach, (n_p,) each."""
        reach = np.where(self.with_prior, self.reach, np.inf)
        lower, upper = ((each - self.prior) / self.scale for each in (self.lower, self.upper))
        return np.maximum(lower, -reach), np.minimum(upper, reach)

    def trusting(self, row: int) -> Unknowns:
        """The same, one of them bounded by what it can be alone, not by what is believed of it."""
        reach = np.array(np.broadcast_to(self.reach, len(self)), dtype=float)
        reach[row] = np.inf
        return replace(self, reach=reach)

    def loosened(self, ratio: float) -> Unknowns:
        """The same with priors ``ratio`` times as wide; then bounds alone hold them."""
        return replace(self, precision=self.precision / ratio**2)

    def values(self, t: np.ndarray) -> dict[str, float]:
        """Parameter values at scaled unknowns, kept within their bounds."""
        raw = np.clip(self.prior + self.scale * self.clipped(t), self.lower, self.upper)
        return {**self.held, **dict(zip(self.names, raw.tolist(), strict=True))}

    def scaled(self, values: Mapping[str, float]) -> np.ndarray:
        """Scaled unknowns of parameter values, shape (n_p,)."""
        return np.array([values[name] for name in self.names]) / self.scale - (
            self.prior / self.scale
        )

    def pinned(self, t: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        """True where an unknown sits at a bound and the cost falls beyond it, shape (n_p,)."""
        low, high = self.ends
        return ((t <= low + 1e-9) & (gradient > 0)) | ((t >= high - 1e-9) & (gradient < 0))

    def clipped(self, t: np.ndarray) -> np.ndarray:
        """Scaled unknowns within their bounds."""
        return np.clip(t, *self.ends)


def nominal_unknowns(
    plant: Plant,
    deviations: Mapping[str, float] | None = None,
    fixed: Iterable[str] = (),
    added: Iterable[Candidate] = (),
    believed: float = np.inf,
) -> Unknowns:
    """Every uncertain parameter of what is present, and the strengths and forms of what is added.

    ``deviations`` are standard deviations that override the catalogue's, and hold what was added
    too, once it is there: the fit that found it tells them, and another recording goes on from it.
    ``fixed`` are never moved.  A strength at its null is absent, and is not moved unless its cause
    is in ``added`` or a little of it is tolerated (``Cause.tolerated``).  What has a prior goes no
    further from it than ``believed`` of its deviations, or of the catalogue's where these are
    wider: a fit of a plant that lacks something is surer of its parameters than it should be.  What
    was added goes on as far as there is, at the price of its prior: it came in while something else
    was missing.
    """
    values, known, added = plant.values, plant.parameters, tuple(added)
    deviations, fixed = dict(deviations or {}), set(fixed)
    measured = {signal.name for signal in plant.measured_inputs}
    free = [name for name in _without_prior(plant, added, deviations) if name not in fixed]
    fixed |= {
        name
        for c in plant.candidates.values()
        if values[c.strength] == known[c.strength].null
        for name in c.forms
        if name not in free
    }
    rows = []
    for name, value in values.items():
        deviation = deviations.get(name, known[name].standard_deviation(value))
        absent = known[name].null is not None and value == known[name].null
        if name in free or name in fixed or name in measured or absent or deviation == 0.0:
            continue
        rows.append((name, value, deviation, 1.0))
    rows += [(name, values[name], _size(plant, name), WIDE**-2) for name in free]
    bounds = {name: (known[name].lower, known[name].upper) for name, *_ in rows}
    for candidate in plant.candidates.values():
        name, tolerated = candidate.strength, candidate.cause.tolerated
        deviation = deviations.get(name, tolerated[0]) if tolerated else 0.0
        if tolerated and deviation > 0.0 and name not in bounds and name not in fixed:
            rows.append((name, values[name], deviation, 1.0))
            bounds[name] = (known[name].lower, tolerated[1])
    names = tuple(row[0] for row in rows)
    prior, scale, precision = (np.array([row[k] for row in rows]) for k in (1, 2, 3))
    lower, upper = (np.array([bounds[n][k] for n in names]) for k in (0, 1))
    usual = np.array([known[name].standard_deviation(value) for name, value, *_ in rows])
    came_in = _movers(added)
    ends = [np.inf if name in came_in else believed for name in names]
    reach = np.array(ends) * np.maximum(usual / scale, 1.0)
    return Unknowns(names, prior, scale, lower, upper, precision, reach=reach)


def _movers(candidates: Iterable[Candidate]) -> set[str]:
    """Strengths and forms of causes."""
    return {name for c in candidates for name in (c.strength, *c.forms)}


def _without_prior(
    plant: Plant, added: Iterable[Candidate], deviations: Mapping[str, float]
) -> list[str]:
    """Strengths and forms of what was added: of what is there already those that nothing tells."""
    values, known = plant.values, plant.parameters
    return [
        name
        for c in added
        for name in (c.strength, *c.forms)
        if name not in deviations or values[c.strength] == known[c.strength].null
    ]


def _size(plant: Plant, name: str) -> float:
    """A tenth of typical, or of one: the step in which an added strength or form is counted."""
    return 0.1 * (abs(plant.parameters[name].typical) or 1.0)

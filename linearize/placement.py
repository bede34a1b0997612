"""Modes where a plant really goes: regions and operating points from a manoeuvre.

The samples of a manoeuvre are clustered into boxes, one mode each.  A mode linearised at sample c
misses the rates of sample s by

    d(c, s) = (f(z_c) + J(z_c) (z_s - z_c) - f(z_s)) / scale,   z = (x, u),

which is what drives its prediction error.  The point of a box is the sample whose model misses the
others least (a medoid, with d as the distance), and the box that gains most is cut in two, along
the signal and at the quantile where it gains most.  So operating points go where the plant is
curved and often, not merely where it is often: clusters of states alone also choose points on
the falling branch of the Stribeck curve, whose model is unstable and good for nothing else.

Regions are boxes, not those of the nearest point: ``HybridModel.active`` looks them up as it does
the standard modes, a guard is one signal against one number, which controllers, solvers and people
can read, and what holds (dry friction at rest) keeps its own interval.

Source: the growing of boxes is that of local linear model trees (LOLIMOT), Nelles 2001,
"Nonlinear System Identification", Ch. 13; here the local models are not fitted but linearised.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from linearize.cuts import Guard, Interval, Level, Region
from linearize.equilibrium import OperatingPoint
from linearize.holding import resting_states
from linearize.modes import Box, HybridModel, Mode, linearised
from linearize.reduction import DesignModel
from linearize.visits import Visited
from workbench.called import called, result

SAMPLES, CANDIDATES = 2000, 40  # of a manoeuvre; points tried in a box
QUANTILES = np.linspace(0.05, 0.95, 19)
LEAST = 20  # samples of a box; boxes of fewer fit one manoeuvre and no other


@dataclass(frozen=True)
class _Region:
    """A box with guards, its samples by number, the one where it is linearised, and sum of d^2.

    ``resting`` are signals that are zero in it.  A box that no sample visits keeps the mode that it
    came from.
    """

    box: Box
    guards: tuple[Guard, ...]
    samples: np.ndarray
    point: int
    defect: float
    resting: tuple[str, ...] = ()
    given: Mode | None = None


@dataclass(frozen=True)
class _Split:
    """Where a region is best cut, and by how much the sum of d squared falls."""

    gain: float
    signal: str
    at: float


@dataclass(frozen=True)
class _Samples:
    """Visited conditions with the model there.

    z, rates      shapes (n, n_x + n_u) and (n, n_x)
    slopes        derivatives of the rates, shape (n, n_x, n_x + n_u)
    touching      where something touches an end stop, shape (n,)
    """

    model: DesignModel
    touching: np.ndarray
    z: np.ndarray
    rates: np.ndarray
    slopes: np.ndarray

    @property
    def names(self) -> tuple[str, ...]:
        return (*self.model.states, *self.model.commands)

    def defects(self, box: Box, at: np.ndarray, of: np.ndarray) -> np.ndarray:
        """Squares of d, summed over states: models at some samples, of others; (n_at, n_of)."""
        held = {name for interval in box.values() for name in interval.holds}
        kept = [i for i, name in enumerate(self.model.states) if name not in held]
        away = self.z[of][None] - self.z[at][:, None]
        slopes, rates = self.slopes[:, kept], self.rates[:, kept]
        foretold = rates[at][:, None] + np.einsum("aij,abj->abi", slopes[at], away)
        return (((foretold - rates[of]) / self.model.scale[kept]) ** 2).sum(axis=2)

    def inside(self, box: Box, guards: tuple[Guard, ...]) -> np.ndarray:
        """Which samples lie in a box where its guards hold, shape (n,).

        A stop is no part of a mode that holds nothing: an impact is over within a sample or two.
        """
        holding = any(region.holds for region in box.values())
        found = np.full(len(self.z), True) if holding else ~self.touching
        signals = dict(zip(self.names, self.z.T, strict=True))
        for name, region in box.items():
            found &= region.contains(signals[name])
        for guard in guards:
            found &= guard.holds(signals)
        return found

    def region(
        self, box: Box, guards: tuple[Guard, ...], samples: np.ndarray, resting: tuple[str, ...]
    ) -> _Region:
        """A box with its samples, and the best of them to linearise at."""
        tried = _some(samples)
        sums = self.defects(box, tried, samples).sum(axis=1)
        best = int(tried[np.argmin(sums)])
        return _Region(box, guards, samples, best, float(sums.min()), resting)

    def halves(self, region: _Region, split: _Split) -> tuple[_Region, _Region]:
        """A region cut in two."""
        signal = split.signal
        whole = region.box.get(signal, Interval("", -np.inf, np.inf, split.at))
        sides = (replace(whole, upper=split.at), replace(whole, lower=split.at))
        boxes = ({**region.box, signal: side} for side in sides)
        low = self.z[region.samples, self.names.index(signal)] < split.at
        pairs = zip(boxes, (region.samples[low], region.samples[~low]), strict=True)
        return tuple(self.region(box, region.guards, each, region.resting) for box, each in pairs)

    def best_split(self, region: _Region) -> _Split:
        """The cut of a region that gains most; no gain where it cannot be cut."""
        splits = [_Split(0.0, "", 0.0)]
        if region.given:
            return splits[0]
        tried = _some(region.samples)
        defects = self.defects(region.box, tried, region.samples)
        for column, name in enumerate(self.names):
            if name in region.resting or (name in region.box and _kept(region.box[name])):
                continue
            values = self.z[region.samples, column]
            cuts = np.unique(np.quantile(values, QUANTILES))
            below = values[:, None] < cuts
            enough = (below.sum(axis=0) >= LEAST) & ((~below).sum(axis=0) >= LEAST)
            own = self.z[tried, column][:, None] < cuts
            lower, upper = (
                np.where(mine, defects @ side, np.inf).min(axis=0)
                for mine, side in ((own, below), (~own, ~below))
            )
            gain = np.where(enough, region.defect - lower - upper, 0.0)
            splits.append(_Split(float(gain.max()), name, float(cuts[gain.argmax()])))
        return max(splits, key=lambda split: split.gain)

    def mode(self, region: _Region) -> Mode:
        """The mode of a region; what is held is linearised at rest."""
        if region.given:
            return replace(region.given, box=region.box)
        z, n = self.z[region.point].copy(), len(self.model.states)
        for name, part in region.box.items():
            if _kept(part):
                z[self.names.index(name)] = part.point
        at = {name: float(z[self.names.index(name)]) for name in region.box}
        box = {name: replace(part, point=at[name]) for name, part in region.box.items()}
        rates = self.model.f(z[:n], z[n:])[0].full().ravel()
        unrest = float(np.abs(rates / self.model.scale).max())
        made = linearised(self.model, box, OperatingPoint(z[:n], z[n:], rates, unrest))
        return replace(made, guards=region.guards)


def placed_modes(
    hybrid: HybridModel, seen: Visited, number: int, most: int = SAMPLES
) -> HybridModel:
    """So many modes of a plant, placed where a manoeuvre goes.

    ``hybrid`` tells the plant, its jumps, and which intervals hold states; of its other cuts only
    the levels of switches and the signals that somewhere hold states stay.  What holds where
    the manoeuvre never goes keeps the mode, and the point, that it has there.

    Raises
    ------
    ValueError
        If there are fewer modes than holding intervals and their neighbours need, or if the
        manoeuvre has too few samples for so many modes.
    """
    last = None
    for last in growing_modes(hybrid, seen, most):
        if len(last.modes) >= number:
            break
    if len(last.modes) == number:
        return last
    few = len(last.modes) < number
    bound = (
        f"at most {len(last.modes)} for this manoeuvre" if few else f"at least {len(last.modes)}"
    )
    raise ValueError(f"{hybrid.model.plant.name}: {number} modes asked for, expected {bound}")


def growing_modes(hybrid: HybridModel, seen: Visited, most: int = SAMPLES) -> Iterator[HybridModel]:
    """The same, by number of modes: from the holding intervals alone on, one more each time."""
    samples = _samples(hybrid.model, seen, most)
    regions = _begin(hybrid, samples)
    modes = [samples.mode(region) for region in regions]
    splits = [samples.best_split(region) for region in regions]
    while True:
        yield replace(hybrid, modes=_named(modes))
        k = int(np.argmax([split.gain for split in splits]))
        if splits[k].gain <= 0.0:
            return
        halves = samples.halves(regions[k], splits[k])
        regions[k : k + 1] = halves
        modes[k : k + 1] = [samples.mode(half) for half in halves]
        splits[k : k + 1] = [samples.best_split(half) for half in halves]


def _begin(hybrid: HybridModel, samples: _Samples) -> list[_Region]:
    """The boxes of a hybrid model without the cuts that may be chosen; the first that holds counts.

    What stays is each signal that somewhere holds states or is switched.
    """
    every = [item for mode in hybrid.modes for item in mode.box.items()]
    staying = {name for name, region in every if _kept(region)}
    found, begun = [], []
    left = np.ones(len(samples.z), dtype=bool)
    for mode in hybrid.modes:
        box = {name: region for name, region in mode.box.items() if name in staying}
        if (box, mode.guards) in begun:
            continue
        begun.append((box, mode.guards))
        inside = left & samples.inside(box, mode.guards)
        left &= ~inside
        if inside.any():
            resting = resting_states(hybrid, mode)
            found.append(samples.region(box, mode.guards, np.flatnonzero(inside), resting))
        else:
            found.append(_Region(box, mode.guards, np.zeros(0, int), -1, 0.0, given=mode))
    return found


def _kept(region: Region) -> bool:
    """True where a region holds states or is a level, and so is not to be cut."""
    return bool(region.holds) or isinstance(region, Level)


def _samples(model: DesignModel, seen: Visited, most: int) -> _Samples:
    every = slice(None, None, max(seen.rows.shape[1] // most, 1))
    rows, touching = seen.rows[:, every], seen.touching[seen.free][every]
    n, count = len(model.states), rows.shape[1]
    rates = result(model.f.map(count), rows[:n], rows[n:])
    A, B, _, _ = called(model.jacobians.map(count), rows[:n], rows[n:])
    slopes = [block.reshape(n, count, -1).transpose(1, 0, 2) for block in (A, B)]
    return _Samples(model, touching, rows.T, rates.T, np.concatenate(slopes, axis=2))


def _some(samples: np.ndarray) -> np.ndarray:
    """Evenly chosen among samples, so many that all can be tried as a point."""
    return samples[np.unique(np.linspace(0, len(samples) - 1, CANDIDATES).astype(int))]


def _named(modes: list[Mode]) -> tuple[Mode, ...]:
    """The modes with names: the labels of what was not chosen, and a number."""
    found, counted = [], {}
    for mode in modes:
        kind = " ".join(region.label for region in mode.box.values() if region.label) or "region"
        counted[kind] = counted.get(kind, 0) + 1
        found.append(replace(mode, name=f"{kind} {counted[kind]}"))
    return tuple(found)

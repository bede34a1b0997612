"""The projected profile scan: what each effect of the catalogue would explain, without a refit.

At a fitted point let r be the weighted residual, J_x and J_p its derivatives in the start states
and in the fitted parameters (with their priors).  What the nuisances cannot explain of a vector is
measured by

    P = I - Q_x Q_x',   J~ = P J_p,   A = (J~'J~ + Lambda)^-1,   M = P - J~ A J~'

For sizes m of effect j the plant is simulated again, r_j(m), and

    c_j(m) = r_j' M r_j  (with the prior's offset kept),   drop_j = c(0) - min_m c_j(m)

This is exact in the effect and linear only in the nuisances.  It needs no derivative in the
effect, so kinks and singular nulls do not matter, and a scan over shapes is the supremum over them
(Davies 1977, 1987).  Its smallest size is Rao's score test, the modification index of structural
equation modelling.

Source: diagnosis.md 1.4.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from workbench.candidate import Candidate
from workbench.diagnosis.blind_starts import blind_starts, freed
from workbench.diagnosis.metric import Metric, every_second, metric_at
from workbench.effect import Parameter
from workbench.fitting.linearised import Linearised, Point
from workbench.fitting.problem import Problem, fuller, stateless
from workbench.fitting.start_states import carried
from workbench.fitting.unknowns import Unknowns
from workbench.fitting.windows import Windows
from workbench.plant import Plant

WIDER = 3.0  # times as wide: the priors of the second look (diagnosis.md 2: 5 % and 15 %)
FEWEST_FROM_PRIORS = 12  # windows that a scan from the priors looks at
LARGEST = 1e15  # deviations: a change beyond runs away, and its square is to stay a number


@dataclass(frozen=True)
class Trial:
    """One size, and shape, of one candidate.

    values      parameter values that put the candidate into the plant
    size        its strength off its null, in typical sizes without sign
    drop        fall of the projected cost against the model without it
    shown       what it adds to the projected cost of a model that is right without it
    nuisance    linear step of the scaled unknowns that goes with it, shape (n_p,)
    """

    candidate: Candidate
    values: Mapping[str, float]
    size: float
    drop: float
    shown: float
    nuisance: np.ndarray


@dataclass(frozen=True)
class Profile:
    """The scan of one candidate: all trials, best first, and its direction.

    signature       what it does to the residual that nothing else can, (rows + n_p,)
    compensation    share of its effect that the fitted parameters can imitate, R^2
    changes         what each trial does to the projected residual, (n_trials, rows)
    drop_wide       the drop with priors ``WIDER`` times as wide; NaN where it was not asked for
    """

    candidate: Candidate
    trials: tuple[Trial, ...]
    signature: np.ndarray
    compensation: float
    changes: np.ndarray = field(repr=False)
    drop_wide: float = float("nan")

    @property
    def drop(self) -> float:
        """Fall of the projected cost at the best size; 0 where no size helps."""
        return max(self.trials[0].drop, 0.0)


def scan(
    whole: Plant,
    windows: Windows,
    unknowns: Unknowns,
    point: Point,
    candidates: Iterable[Candidate],
    at: Linearised | None = None,
    fixed: Collection[str] = (),
    each: float = 1.0,
) -> list[Profile]:
    """Profiles of all candidates, the one that explains most first.

    ``whole`` is the windows' plant with all absent effects in their places.  Candidates with
    states of their own are run on a plant that has them; the others share one, so that all their
    sizes run side by side.  ``at`` are the derivatives at the point where they are known already,
    ``fixed`` are shapes that stay.  Every second window is enough to tell candidates apart where
    there are many; drops, in weighted squares, count as of all, and as often as ``each`` of the
    windows stands for others that are not there.
    """
    windows, point, metric, of_all = every_second(windows, unknowns, point, at, each)
    wide = metric_at(windows, unknowns.loosened(WIDER), point, metric.at, of_all)
    blind = blind_starts(windows.plant, metric.at)
    values = unknowns.values(point.t)
    profiles = []
    known = whole.parameters
    for needed, members in _groups(whole, windows.plant, candidates).items():
        richer = windows.with_plant(fuller(whole, windows.plant, *needed)) if needed else windows
        starts = carried(point.starts, windows, richer)
        trials = [
            (candidate, change)
            for candidate in members
            for change in sizes_to_try(richer.plant, candidate, fixed)
        ]
        plants = [richer.plant.with_values({**values, **change}) for _, change in trials]
        residuals = richer.residuals(plants, starts)
        rows = metric.rows(residuals)
        if blind:
            freer = freed(metric.at, windows.plant, richer, plants, starts, residuals)
            alone = zip(freer, residuals, strict=True)
            rows = np.array([replace(metric, at=at).rows(r[None])[0] for at, r in alone])
        sizes = [_typical_sizes(known[c.strength], change[c.strength]) for c, change in trials]
        profiles += _profiles(metric, wide, trials, sizes, rows, of_all)
    return sorted(profiles, key=lambda profile: -profile.drop)


def scan_catalogue(problem: Problem) -> list[Profile]:
    """Profiles of the causes that are not there and not shifts of fitted parameters."""
    base = problem.base
    absent, at = _absent(problem), problem.linearised
    fixed = problem.rig.fixed
    return scan(problem.whole, base.windows, base.unknowns, base.point, absent, at, fixed)


def scan_from_priors(problem: Problem) -> list[Profile]:
    """The same where no parameter has moved yet.

    Parameters that imitate an effect hide it from a scan at the prior fit: what an underlap lets
    through, a leak and another heat flow together do too, several deviations off their priors, or
    within them where they are wide.
    Its leaders alone are asked for: a quarter of the windows are enough, each for all that it
    stands for.
    """
    base = problem.base
    windows, kept = base.windows.part(max(len(base.windows) // 4, FEWEST_FROM_PRIORS))
    point = Point(problem.at_priors, base.point.starts[:, kept])
    absent, fixed = _absent(problem), problem.rig.fixed
    each = len(base.windows) / len(windows)
    return scan(problem.whole, windows, base.unknowns, point, absent, fixed=fixed, each=each)


def _absent(problem: Problem) -> list[Candidate]:
    base = problem.base
    values = base.plant.values
    known = problem.whole.parameters
    return [
        c
        for c in problem.whole.candidates.values()
        if c.held is None and c.strength not in problem.rig.fixed
        and c not in problem.added and base.windows.plant.ready_for(c)
        and (c.cause.tolerated or values.get(c.strength, known[c.strength].null)
             == known[c.strength].null)
    ]  # fmt: skip


def sizes_to_try(
    plant: Plant, candidate: Candidate, fixed: Collection[str] = ()
) -> list[dict[str, float]]:
    """Parameter values of every size and shape of a candidate, within its bounds.

    Shapes that are ``fixed`` stay as the plant has them, and those that its member has no room for.
    """
    known = plant.parameters[candidate.strength]
    null = known.null or 0.0
    signs = (1.0, -1.0) if known.signed else (1.0,)
    tried = plant.member(candidate.member).shapes_of(candidate.cause)
    grids = {f"{candidate.member}.{key}": grid for key, grid in tried.items()}
    grids = {name: grid for name, grid in grids.items() if name not in fixed}
    shapes = [dict(zip(grids, values, strict=True)) for values in product(*grids.values())]
    return [
        {candidate.strength: null + sign * size * known.typical, **shape}
        for sign in signs
        for size in candidate.cause.sizes
        if known.lower <= null + sign * size * known.typical <= known.upper
        for shape in shapes
    ]


def _typical_sizes(known: Parameter, value: float) -> float:
    """How far a strength is off its null, in typical sizes."""
    return abs((value - (known.null or 0.0)) / known.typical)


def _profiles(
    metric: Metric,
    wide: Metric,
    trials: list[tuple[Candidate, dict[str, float]]],
    sizes: list[float],
    rows: np.ndarray,
    of_all: float,
) -> list[Profile]:
    found: dict[str, list[tuple[Trial, np.ndarray]]] = {}
    before, as_it_is = metric.cost, metric.normal.residual
    for (candidate, change), size, row in zip(trials, sizes, rows, strict=True):
        cost, step = metric.explained(row)
        shown = of_all * metric.shown(row - as_it_is)
        trial = Trial(candidate, change, size, of_all * (before - cost), shown, step)
        found.setdefault(candidate.name, []).append((trial, row))
    profiles = []
    for pairs in found.values():
        pairs.sort(key=lambda pair: -pair[0].drop)
        best, row = pairs[0]
        signature, share = metric.signature(as_it_is - row)
        changes = np.array([_single(row - as_it_is) for _, row in pairs])
        trials = tuple(trial for trial, _ in pairs)
        drop_wide = of_all * max(wide.cost - wide.explained(row)[0] for _, row in pairs)
        profiles.append(
            Profile(best.candidate, trials, signature, share, changes, max(drop_wide, 0.0))
        )
    return profiles


def _single(change: np.ndarray) -> np.ndarray:
    """A change of the residuals as one row in single precision, of a plant that runs away too."""
    return np.clip(change, -LARGEST, LARGEST).ravel().astype(np.float32)


def _groups(
    whole: Plant, plant: Plant, candidates: Iterable[Candidate]
) -> dict[tuple[str, ...], list[Candidate]]:
    """Candidates that run on one plant, by the members that ``plant`` lacks for them."""
    candidates, there = list(candidates), plant.values
    plain = {effect.name for effect in stateless(whole)}
    missing = (c.member for c in candidates if c.strength not in there and c.member in plain)
    together = tuple(dict.fromkeys(missing))
    groups: dict[tuple[str, ...], list[Candidate]] = {(): [], together: []}
    for each in candidates:
        own = together if each.member in plain else (each.member,)
        groups.setdefault(() if each.strength in there else own, []).append(each)
    return {needed: members for needed, members in groups.items() if members}

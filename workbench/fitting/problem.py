"""The prior fit that every diagnosis starts from: windows, what may move, and how far it got."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from workbench.candidate import Candidate
from workbench.effect import Effect
from workbench.fitting.beyond_noise import fall_beyond_noise
from workbench.fitting.continued import continued
from workbench.fitting.costs import points_costs
from workbench.fitting.gauss_newton import Fit, fit_windows
from workbench.fitting.linearised import Linearised, Point, plant_at
from workbench.fitting.no_worse import no_worse_than_it_came
from workbench.fitting.noise import measured_noise
from workbench.fitting.own_errors import ITERATIONS, consistent, weighed_anew
from workbench.fitting.pulled_in import towards_priors
from workbench.fitting.shaken import shaken
from workbench.fitting.start_states import carried, refit_starts
from workbench.fitting.unknowns import Unknowns, nominal_unknowns
from workbench.fitting.window_length import window_length_s
from workbench.fitting.windows import MOST_WINDOWS, Windows, cut_windows, one_clock
from workbench.plant import Plant
from workbench.recording import Recording, same_data
from workbench.rig import Rig

FIRST_ITERATIONS = 3  # with scales from the model as it came
LEAST_HELD_OUT_WINDOWS = 24
NO_EVIDENCE = "a validation recording is one of the training recordings, which proves nothing"
# Prior deviations that a diagnosis lets what is there go, chosen.  Without an end the prior fit of
# a gearbox with a late command takes a coil 20 of them off, and the delay has nothing to explain.
BELIEVED = 5.0
LEAST_IMPROVEMENT = 0.03  # of the misfit, for a prior fit to be taken up again


@dataclass(frozen=True)
class Problem:
    """A rig, its recordings cut into windows, and the fit of what is there.

    Attributes
    ----------
    whole
        The plant with all absent effects in their places, for the recordings' channels.
    added
        Causes that the rig file added: their strengths are free, but for the rig's deviations.
    base
        The prior fit on the training windows.
    base_validation
        The base plant on the held-out windows, only start states refitted; None without any.
    believed
        How many prior deviations a parameter may go; see :data:`BELIEVED`.
    """

    rig: Rig
    whole: Plant
    added: tuple[Candidate, ...]
    base: Fit
    base_validation: Fit | None
    believed: float = inf

    def unknowns(self, plant: Plant, *more: Candidate) -> Unknowns:
        """What a fit of a plant may move, with more causes added."""
        added = (*self.added, *more)
        return nominal_unknowns(plant, self.rig.deviations, self.rig.held, added, self.believed)

    def validated(self, fit: Fit) -> Fit | None:
        """A fitted plant on the held-out windows, only start states refitted."""
        if self.base_validation is None:
            return None
        windows = self.base_validation.windows
        if fit.windows.plant is not windows.plant:
            windows = windows.with_plant(fit.windows.plant)
        found = refit_starts(windows, fit.plant.values, self.base_validation)
        return continued(found, ITERATIONS)

    def with_base(self, base: Fit) -> Problem:
        """The same with another prior fit of the same windows, held out too."""
        held_out = self.base_validation and held_out_fit(self.base_validation.windows, base)
        return replace(self, base=base, base_validation=held_out)

    @property
    def at_priors(self) -> np.ndarray:
        """The scaled unknowns of the base at their priors; what was added has none, and stays."""
        return towards_priors(self.base, 0.0)

    @property
    def linearised(self) -> Linearised:
        """Residuals and derivatives at the base, for scan, shifts and refits."""
        return self.base.derivatives

    @property
    def misfit(self) -> float:
        """Squared error of the base beyond sensor noise, with the price of its priors."""
        return self.base.misfit


def training_fall(before: Fit, after: Fit) -> float:
    """How much of the misfit beyond noise went away, with the price of the priors."""
    fall = fall_beyond_noise(before.windows, before.squares, after.squares)
    return fall + (before.cost - before.chi2) - (after.cost - after.chi2)


def training_drop(before: Fit, after: Fit) -> float:
    """The same as a share of what there was."""
    return training_fall(before, after) / before.misfit


def staged(whole: Plant, *members: str) -> Plant:
    """The whole plant without what is absent, but for the named members and what is tolerated.

    What is absent adds nothing, but all of it together would take a third of the time of a step.
    """
    tolerated = [e.name for e in stateless(whole) if any(cause.tolerated for cause in e.causes)]
    return whole.lean(keep=[*tolerated, *members])


def fuller(whole: Plant, plant: Plant, *members: str) -> Plant:
    """The whole plant staged for the named members and for all that another one of it holds.

    That one may hold what is absent, and in full what could be reduced: the friction of which an
    added cause is one keeps its bristle, whose state has to be there again.
    """
    held = [e.name for e in plant.effects if e.absent or e.reduced() is not e]
    return staged(whole, *held, *members)


def stateless(plant: Plant) -> list[Effect]:
    """The effects of a plant that bring no states."""
    return [effect for effect in plant.effects if not tuple(effect.states())]


def improved_base(problem: Problem, fits: Sequence[Fit]) -> Problem | None:
    """The problem with a better prior fit, where the refits found its parameters; else None.

    A refit whose nominal parameters alone, with its effect taken away again, are better than the
    base, or soon lead to better ones, has found a place that the prior fit missed; its effect would
    get the credit for that.
    """
    base = problem.base
    points = []
    for fit in fits:
        values = {**base.windows.plant.values, **fit.plant.values}
        t = base.unknowns.clipped(base.unknowns.scaled(values))
        points.append(Point(t, carried(fit.point.starts, fit.windows, base.windows)))
    if not points:
        return None
    best = points_costs(base.windows, base.unknowns, points).best
    least = base.cost - LEAST_IMPROVEMENT * problem.misfit
    if best.cost > least:
        tried = fit_windows(base.windows, base.unknowns, best, FIRST_ITERATIONS)
        if tried.cost > least:
            return None
        best = tried.point
    better = continued(fit_windows(base.windows, base.unknowns, best, ITERATIONS), ITERATIONS)
    return replace(problem, base=better, base_validation=problem.validated(better))


def pose(
    rig: Rig,
    train: Sequence[Recording],
    validation: Sequence[Recording] = (),
    most_windows: int = MOST_WINDOWS,
    believed: float = inf,
    progress: Callable[[str], None] = lambda message: None,
) -> Problem:
    """Cut, fit and validate.

    ``believed`` bounds how many prior deviations a parameter may go: see :data:`BELIEVED`.
    ``progress`` is told of each stage, since a stiff plant takes a minute for one.

    The fit is made twice, the second time with the error model of the first, and again where that
    one tells far other errors; then from starts that earlier windows give and points beside it,
    and from the values that the rig came with where these cost less.

    Raises
    ------
    ValueError
        If the recordings hold no whole window, differ in their sample times, or show no noise, or
        if nothing is recorded in what is held out.
    """
    one_clock([*train, *validation])
    whole = rig.fit_for(train[0])
    added = rig.added_to(whole)
    plant = staged(whole, *(c.member for c in added))
    noise = measured_noise(train, plant.measured)
    length_s = window_length_s(plant, train, validation)
    windows = cut_windows(plant, train, noise, length_s, most_windows)
    unseen = _unseen(windows, validation)
    unknowns = nominal_unknowns(plant, rig.deviations, rig.held, added, believed)
    progress(f"prior fit of {len(unknowns)} parameters to {len(windows)} windows")
    first = fitted_twice(windows, unknowns, unknowns.scaled(plant.values))
    progress("prior fit weighed by its own errors")
    found = continued(consistent(first), ITERATIONS)
    progress("prior fit from points beside it")
    base = no_worse_than_it_came(shaken(found, ITERATIONS))
    held_out = None
    if unseen is not None:
        progress("prior fit on what is held out")
        held_out = held_out_fit(unseen, base)
    return Problem(rig, whole, added, base, held_out, believed)


def _unseen(windows: Windows, validation: Sequence[Recording]) -> Windows | None:
    """Windows of what is held out, cut as those of the training; None where nothing is.

    Half as many as the training has are enough to judge a plant that is not fitted to them.
    """
    if not validation:
        return None
    most = max(len(windows) // 2, LEAST_HELD_OUT_WINDOWS)
    cut_s = windows.length * windows.recordings[0].sample_time_s
    noise = dict(zip(windows.plant.measured, windows.noise.tolist(), strict=True))
    unseen = cut_windows(windows.plant, validation, noise, cut_s, most)
    if not unseen.count:
        names = ", ".join(each.name for each in validation)
        raise ValueError(
            f"{names}: no output is recorded in what is held out, so nothing can be judged on it; "
            "expected a recording with measurements (--validate)"
        )
    return unseen


def posed(rig: Rig, base: Fit, base_validation: Fit | None) -> Problem:
    """A problem whose fits are there already, those of a diagnosis of the rig."""
    whole = rig.fit_for(base.windows.recordings[0])
    return Problem(rig, whole, rig.added_to(whole), base, base_validation, BELIEVED)


def fitted_twice(windows: Windows, unknowns: Unknowns, t: np.ndarray) -> Fit:
    """A fit from scaled unknowns (n_p,), the second time with the error model of the first."""
    start = Point(t, windows.start)
    windows = windows.rescaled(windows.residuals([plant_at(windows, unknowns, t)], start.starts)[0])
    rough = fit_windows(windows, unknowns, start, FIRST_ITERATIONS)
    return weighed_anew(rough)


def held_out_fit(windows: Windows, base: Fit, near: Fit | None = None) -> Fit:
    """A fit on held-out windows, on the yardstick of its training.

    ``near`` is the same plant there on another yardstick, whose start states may suit too.
    """
    windows = windows.scaled_like(base.windows)
    rough = continued(refit_starts(windows, base.plant.values, near), ITERATIONS)
    begun = refit_starts(windows.capped(rough.residual), base.plant.values, rough)
    return continued(begun, ITERATIONS)


def proves_nothing(train: Sequence[Recording], validation: Sequence[Recording]) -> bool:
    """True where a recording stands in both sets."""
    return any(same_data(one, other) for one in train for other in validation)


def split(recordings: Sequence[Recording]) -> tuple[list[Recording], list[Recording]]:
    """The first two thirds of each recording and its last third, cut between pieces near there."""
    cuts = [_two_thirds(recording) for recording in recordings]
    early = [r.part(0, cut) for r, cut in zip(recordings, cuts, strict=True)]
    late = [r.part(cut, len(r)) for r, cut in zip(recordings, cuts, strict=True)]
    named = [replace(r, name=f"{r.name}, last third") for r in late]
    return early, named


def _two_thirds(recording: Recording) -> int:
    """The sample at two thirds, or the start of a piece near it."""
    n = len(recording)
    near = [first for first in recording.starts if n / 2 <= first <= 5 * n / 6]
    return min(near, key=lambda first: abs(3 * first - 2 * n), default=2 * n // 3)

"""The recording that would show what the last ones could not, were it there.

For every effect that the recordings are blind to let the model have it in its typical size.  T is
the chi2 by which the model as it is would be worse on what that one records of a manoeuvre, its
parameters and start states refitted (:mod:`workbench.diagnosis.rivals`).  The effect would then be
accepted where T reaches what the judge asks for: enough chi2 for its parameters with the power of
:func:`least_gain`, and a fifth of the misfit that all recordings have together then.  The manoeuvre
that brings most of the effects nearest to that, or beyond, is the one to record.

Source: diagnosis.md 1.4 (power) and 1.8.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from workbench.candidate import Candidate
from workbench.diagnosis.judge import LEAST_SHARE
from workbench.diagnosis.manoeuvre_choice import (
    FIRST_WINDOWS,
    WINDOWS,
    asked_for,
    chosen,
    inside,
    least_gain,
    with_one_more,
)
from workbench.diagnosis.result import NextRecording, Ranked
from workbench.diagnosis.rivals import distances
from workbench.diagnosis.rough import windows_for
from workbench.diagnosis.verdict import BLIND_SHOWN
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.linearised import Point
from workbench.fitting.problem import Problem
from workbench.fitting.start_states import carried
from workbench.manoeuvres.library import LIBRARY
from workbench.manoeuvres.limits import Limits, limits_of
from workbench.manoeuvres.play import Manoeuvre

NOTHING = "nothing"  # the rival that is the model as it is


def showing(
    problem: Problem, ranking: Sequence[Ranked], library: Sequence[Manoeuvre] = LIBRARY
) -> NextRecording | None:
    """The manoeuvre that shows most of the blind effects which the verdict names; None without any.

    ``alike`` are those that it would not show either.  In words alone where nothing can be played
    or no manoeuvre shows any of them.
    """
    blind = [row.candidate for row in ranking if row.blind][:BLIND_SHOWN]
    if not blind:
        return None
    names = (NOTHING, *(candidate.name for candidate in blind))
    advice = NextRecording(blind[0].cause.shown_by, names, float("nan"))
    base = problem.base
    if not base.windows.plant.commands:
        return advice
    fits = [base, *(supposed(problem, candidate) for candidate in blind)]
    limits = limits_of(base.plant, base.windows.recordings)
    rehearsed = inside(fits, limits, library)
    if not rehearsed:
        return advice
    needs = np.array([_needed(problem, limits, candidate) for candidate in blind])
    pairs = [(0, k) for k in range(1, len(fits))]
    best, shown = chosen(
        rehearsed,
        lambda few: distances(fits, few, FIRST_WINDOWS, pairs),
        lambda few: distances(fits, few, WINDOWS, pairs),
        lambda found: np.minimum(found / needs, 1.0).sum(axis=1),
    )
    seen = shown >= needs
    if not seen.any():
        return advice
    hidden = tuple((NOTHING, name) for name, told in zip(names[1:], seen, strict=True) if not told)
    plants = dict(zip(names, fits, strict=True))
    return asked_for(plants, limits, best, float(shown[seen].min()), hidden)


def supposed(problem: Problem, candidate: Candidate) -> Fit:
    """The base with a candidate in its typical size; nothing is fitted, and only its plant counts.

    Of an effect with shapes it is the one that the plant has at null.
    """
    base, windows = problem.base, windows_for(problem, candidate)
    known = problem.whole.parameters[candidate.strength]
    size = float(np.clip((known.null or 0.0) + known.typical, known.lower, known.upper))
    unknowns = problem.unknowns(windows.plant, candidate)
    values = {**windows.plant.values, **base.plant.values, candidate.strength: size}
    point = Point(
        unknowns.clipped(unknowns.scaled(values)),
        carried(base.point.starts, base.windows, windows),
    )
    return replace(base, windows=windows, unknowns=unknowns, point=point)


def _needed(problem: Problem, limits: Limits, candidate: Candidate) -> float:
    """The T with which a candidate would be accepted, one recording more among the others."""
    base = problem.base
    samples = with_one_more(base, limits)
    misfit = samples * problem.misfit / max(base.cost, 1.0)  # weighted errors have unit size
    enough = least_gain(1 + len(candidate.forms), samples)
    return max(LEAST_SHARE / (1.0 - LEAST_SHARE) * misfit, enough)

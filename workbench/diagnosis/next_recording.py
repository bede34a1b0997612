"""The next recording: the manoeuvre that tells apart what the last ones could not.

Of all manoeuvres that keep the limits of the rig for every rival, the one with the largest smallest
distance between any two (:mod:`workbench.diagnosis.rivals`).  Each rival is rehearsed with the same
position loop around it, and compared on the commands that the loop gave.  Where the recordings
would not show the effects at all, see :mod:`workbench.diagnosis.showing`.

Source: diagnosis.md 1.8.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

from workbench.diagnosis.judge import SHARE_REASON
from workbench.diagnosis.manoeuvre_choice import (
    FIRST_WINDOWS,
    WINDOWS,
    Plants,
    asked_for,
    chosen,
    inside,
    least_gain,
    with_one_more,
)
from workbench.diagnosis.result import NextRecording, Ranked, Verdict
from workbench.diagnosis.rivals import distances
from workbench.diagnosis.showing import NOTHING, showing
from workbench.diagnosis.ties import LARGEST_TIE
from workbench.diagnosis.verdict import unsized
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.problem import Problem
from workbench.manoeuvres.library import LIBRARY
from workbench.manoeuvres.limits import Limits, limits_of
from workbench.manoeuvres.play import Manoeuvre

ASKING = (Verdict.TIE, Verdict.SMALL_PROXY, Verdict.RECORDING_TOO_WEAK)


def recommended(
    problem: Problem,
    verdict: Verdict,
    ranking: Sequence[Ranked],
    progress: Callable[[str], None],
) -> NextRecording | None:
    """What to record next where a verdict leaves a question open; None where it does not.

    A tie asks to be broken, and a proxy to be told from others that explain as little; without any,
    as with a verdict on one recording alone, it is to be told from the model as it is.  A recording
    that shows too little asks for one that shows more.
    """
    leader = ranking[0] if ranking else None
    if verdict not in ASKING or leader is None:
        return None
    if verdict is Verdict.RECORDING_TOO_WEAK and not (leader.accepted or unsized(ranking)):
        progress("next recording")
        return showing(problem, ranking)
    if leader.fit is None:
        return None
    progress("next recording")
    alike = leader.alike
    if verdict is Verdict.SMALL_PROXY:
        alike = (*alike, *(r.candidate.name for r in ranking[1:] if r.reasons == (SHARE_REASON,)))
        alike = alike[: LARGEST_TIE - 1]
    tied = {r.candidate.name: r.fit for r in ranking if r.candidate.name in alike}
    others = {name: fit for name, fit in tied.items() if fit} or {NOTHING: problem.base}
    rivals = {leader.candidate.name: leader.fit, **others}
    found = next_recording(rivals) if problem.base.windows.plant.commands else None
    return found or NextRecording(leader.candidate.cause.shown_by, tuple(rivals), float("nan"))


def next_recording(rivals: Plants, library: Sequence[Manoeuvre] = LIBRARY) -> NextRecording | None:
    """The manoeuvre of the library that tells all rivals apart best; None where none does.

    ``rivals`` are fits to the same recordings by name, the likeliest first.

    Raises
    ------
    ValueError
        If there are fewer than two.
    """
    if len(rivals) < 2:
        raise ValueError(f"next recording: {len(rivals)} rivals; expected at least two")
    fits = list(rivals.values())
    limits = limits_of(fits[0].plant, fits[0].windows.recordings)
    rehearsed = inside(fits, limits, library)
    if not rehearsed:
        return None
    least = _least(fits, limits)

    def gain(found: np.ndarray) -> np.ndarray:
        """Smallest T of each manoeuvre over the pairs that any of them tells apart.

        Rivals that no manoeuvre tells apart have no say in the choice.
        """
        told = (found >= least).any(axis=0)
        return (found[:, told] if told.any() else found).min(axis=1)

    best, exact = chosen(
        rehearsed,
        lambda few: distances(fits, few, FIRST_WINDOWS),
        lambda few: distances(fits, few, WINDOWS, settled=True),
        gain,
    )
    if (exact < least).all():
        return None
    pairs = zip(combinations(rivals, 2), exact < least, strict=True)
    alike = tuple(pair for pair, same in pairs if same)
    return asked_for(rivals, limits, best, float(exact[exact >= least].min()), alike)


def _least(fits: Sequence[Fit], limits: Limits) -> np.ndarray:
    """The T from which on each pair counts as told apart, in the order of combinations of two."""
    samples = with_one_more(fits[0], limits)
    sizes = [len(fit.unknowns) for fit in fits]
    return np.array([least_gain(abs(a - b), samples) for a, b in combinations(sizes, 2)])

"""The next recording: the manoeuvre that tells apart what the last ones could not.

Of all manoeuvres that keep the limits of the rig for every rival, the one with the largest smallest
distance between any two (:mod:`workbench.diagnosis.rivals`).  Each rival is rehearsed with the same
position loop around it, and compared on the commands that the loop gave.

Source: diagnosis.md 1.8.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from workbench.diagnosis.result import NextRecording, Ranked, Verdict
from workbench.diagnosis.rivals import Rehearsed, distances
from workbench.fitting.gauss_newton import Fit
from workbench.manoeuvres.library import LIBRARY
from workbench.manoeuvres.limits import Limits, limits_of
from workbench.manoeuvres.play import Manoeuvre
from workbench.manoeuvres.rehearse import rehearse, speed_maps

NOTHING = "nothing"  # the rival that is the model as it is
ASKING = (Verdict.TIE, Verdict.SMALL_PROXY)
SHARES = (1.0, 0.6, 0.35)  # of the full size of a manoeuvre, until it breaks no limit
LEAST_GAIN = 10.0  # of chi2: below it two rivals stay alike
FIRST_WINDOWS, WINDOWS = 8, 25  # of each manoeuvre in a first look, and in the one that decides
FOLLOWED = 3  # manoeuvres beyond the first look

Rivals = Mapping[str, Fit]
Pairs = tuple[tuple[str, str], ...]


def recommended(
    verdict: Verdict, ranking: Sequence[Ranked], base: Fit, progress: Callable[[str], None]
) -> NextRecording | None:
    """What to record next where a verdict leaves a question open; None where it does not.

    A tie asks to be broken; a proxy, or a verdict on one recording alone, to be told from the
    model as it is.
    """
    leader = ranking[0] if ranking else None
    if verdict not in ASKING or leader is None or leader.fit is None:
        return None
    progress("next recording")
    tied = {r.candidate.name: r.fit for r in ranking if r.candidate.name in leader.tied_with}
    others = {name: fit for name, fit in tied.items() if fit} or {NOTHING: base}
    rivals = {leader.candidate.name: leader.fit, **others}
    found = next_recording(rivals) if base.windows.plant.commands else None
    return found or NextRecording(leader.candidate.cause.shown_by, tuple(rivals), float("nan"))


def next_recording(rivals: Rivals, library: Sequence[Manoeuvre] = LIBRARY) -> NextRecording | None:
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
    rehearsed = _inside(fits, limits, library)
    if not rehearsed:
        return None
    rough = distances(fits, rehearsed, FIRST_WINDOWS)
    followed = [rehearsed[k] for k in np.argsort(-_gain(rough))[:FOLLOWED]]
    exact = distances(fits, followed, WINDOWS)
    best = int(_gain(exact).argmax())
    if exact[best].max() < LEAST_GAIN:
        return None
    pairs = zip(combinations(rivals, 2), exact[best], strict=True)
    alike = tuple(pair for pair, gain in pairs if gain < LEAST_GAIN)
    return _result(rivals, limits, followed[best], float(_gain(exact)[best]), alike)


def _gain(found: np.ndarray) -> np.ndarray:
    """Smallest T of each manoeuvre over the pairs that any of them tells apart, (n_manoeuvres,).

    Rivals that no manoeuvre tells apart have no say in the choice.
    """
    told = found.max(axis=0) >= LEAST_GAIN
    return (found[:, told] if told.any() else found).min(axis=1)


def _inside(fits: Sequence[Fit], limits: Limits, library: Sequence[Manoeuvre]) -> list[Rehearsed]:
    """Manoeuvres that break no limit for any rival, each as large as it may be."""
    left = [each for each in library if each.drive is limits.drive]
    maps = speed_maps(fits[0], limits)
    found = []
    for share in SHARES:
        if not left:
            break
        tried = [Rehearsed(each, each.make(limits, share), ()) for each in left]
        for fit in fits:
            runs = rehearse(fit, limits, [each.play for each in tried], maps)
            tried = [
                replace(each, recorded=(*each.recorded, run))
                for each, run in zip(tried, runs, strict=True)
                if not limits.broken_by(run, each.manoeuvre.ends)
            ]
        found += tried
        sound = [each.manoeuvre for each in tried]
        left = [each for each in left if each not in sound]
    return found


def _result(
    rivals: Rivals, limits: Limits, best: Rehearsed, gain: float, alike: Pairs
) -> NextRecording:
    windows = next(iter(rivals.values())).windows
    looped = best.play.looped
    how = "its reference followed by a position loop" if looped else "its commands played"
    length_s = limits.sample_time_s * limits.samples
    return NextRecording(
        what=f"{best.manoeuvre.words}, {length_s:.3g} s, {how}",
        separates=tuple(rivals),
        expected_gain=gain,
        alike=alike,
        predicted=dict(zip(rivals, best.recorded, strict=True)),
        commands=windows.plant.model.commands,
        reference={
            axis.output: row
            for axis, row in zip(limits.axes, best.play.reference, strict=True)
            if looped
        },
        noise=dict(zip(windows.plant.measured, windows.noise.tolist(), strict=True)),
    )

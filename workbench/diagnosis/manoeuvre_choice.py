"""What the choice of a next recording is made of: sound manoeuvres, their worth, the answer.

How much chi2 is enough.  Where the right one of two models is expected to be better by T, it comes
out better by T + 2 sqrt(T) z with z standard normal: |e + D|^2 - |e|^2 = |D|^2 + 2 e'D.  The judge
asks for a fall of the BIC by 4, and for ln(n_eff) more for every parameter that the right one has
more, together a.  It gets that in eight recordings of ten, z = -q = -0.84, where

    T - 2 q sqrt(T) >= a,   so   T = (q + sqrt(q^2 + a))^2

which is 9.1 for rivals with equally many parameters.

Source: Hunter and Reiner 1965 for T; the criterion is that of :mod:`workbench.diagnosis.judge`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import log, sqrt

import numpy as np

from workbench.diagnosis.judge import LEAST_BIC, effective_samples
from workbench.diagnosis.result import NextRecording
from workbench.diagnosis.rivals import Rehearsed
from workbench.fitting.gauss_newton import Fit
from workbench.manoeuvres.conduct import conduct
from workbench.manoeuvres.limits import Limits
from workbench.manoeuvres.play import Manoeuvre
from workbench.manoeuvres.rehearse import rehearse, speed_maps

SHARES = (1.0, 0.6, 0.35)  # of the full size of a manoeuvre, until it breaks no limit
EIGHT_OF_TEN = 0.8416  # quantile of the standard normal
FIRST_WINDOWS, WINDOWS = 8, 25  # of each manoeuvre in a first look, and in the one that decides
FOLLOWED = 3  # manoeuvres beyond the first look

Plants = Mapping[str, Fit]
Pairs = tuple[tuple[str, str], ...]
Distances = Callable[[Sequence[Rehearsed]], np.ndarray]
Worth = Callable[[np.ndarray], np.ndarray]


def least_gain(more: int = 0, samples: float = 1.0) -> float:
    """The T from which on two models count as told apart; see the module.

    ``more`` parameters has the right one, ``samples`` are effective ones of all recordings.
    """
    asked = LEAST_BIC + more * log(max(samples, 1.0))
    return (EIGHT_OF_TEN + sqrt(EIGHT_OF_TEN**2 + asked)) ** 2


def with_one_more(fit: Fit, limits: Limits) -> float:
    """Effective samples of the recordings of a fit, and of one more within these limits."""
    recorded = len(fit.windows) * fit.windows.length
    return effective_samples(fit) * (1.0 + limits.samples / recorded)


def chosen(
    rehearsed: Sequence[Rehearsed], first_look: Distances, decisive: Distances, worth: Worth
) -> tuple[Rehearsed, np.ndarray]:
    """The manoeuvre of most worth with its T of each pair, (n_pairs,).

    Both looks give T (n_manoeuvres, n_pairs), the first of all and the decisive one of the best,
    which are few; ``worth`` is (n_manoeuvres,) from that.
    """
    rough = worth(first_look(rehearsed))
    followed = [rehearsed[k] for k in np.argsort(-rough, kind="stable")[:FOLLOWED]]
    found = decisive(followed)
    best = int(worth(found).argmax())
    return followed[best], found[best]


def inside(fits: Sequence[Fit], limits: Limits, library: Sequence[Manoeuvre]) -> list[Rehearsed]:
    """Manoeuvres that break no limit for any plant, each as large as it may be.

    None where windows last longer than any: nothing could be judged by them.
    """
    if limits.samples < fits[0].windows.length:
        return []
    left = [each for each in library if each.drive is limits.drive]
    maps = tuple(speed_maps(fits[0], limits))
    found = []
    for share in SHARES:
        if not left:
            break
        tried = [Rehearsed(each, each.make(limits, share), (), maps) for each in left]
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


def asked_for(
    plants: Plants, limits: Limits, best: Rehearsed, gain: float, alike: Pairs
) -> NextRecording:
    """The answer in words and numbers."""
    windows = next(iter(plants.values())).windows
    looped = best.play.looped
    how = "its reference followed by a position loop" if looped else "its commands played"
    length_s = limits.sample_time_s * limits.samples
    return NextRecording(
        what=f"{best.play.words or best.manoeuvre.words}, {length_s:.3g} s, {how}",
        separates=tuple(plants),
        expected_gain=gain,
        alike=alike,
        predicted=dict(zip(plants, best.recorded, strict=True)),
        commands=windows.plant.model.commands,
        reference={
            axis.output: row
            for axis, row in zip(limits.axes, best.play.reference, strict=True)
            if looped
        },
        noise=dict(zip(windows.plant.measured, windows.noise.tolist(), strict=True)),
        conduct=conduct(
            limits,
            windows.plant,
            best.recorded,
            windows.recordings,
            best.maps if looped else (),
        ),
    )

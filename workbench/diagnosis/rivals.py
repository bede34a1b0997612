"""How far apart two rivals are on what one of them would record.

For rivals j and k, both refitted, let r be the weighted residual of k on what j would record of a
manoeuvre, cut into the windows of the diagnosis.  What k cannot explain of it by its start states
and by its parameters, which the recordings so far hold with the precision L_k, is

    T_jk = min over p_k of |r|^2 = r' (1 - J_k (J_k' J_k + L_k)^-1 J_k') r

with the start states projected out of r and J_k: the Hunter-Reiner distance, the chi2 by which the
right one of the two is expected to be better.  Of each output it counts as many samples as its
sensor gave in the recordings so far: a rehearsal has one at every tick of the clock.

Source: diagnosis.md 1.8; Hunter and Reiner 1965, "Designs for discriminating between two rival
models".
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from workbench.fitting.error_model import OUTLYING
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.holes import usual_gap
from workbench.fitting.linearised import Linearised, Point, borrowed, linearise
from workbench.fitting.posterior import posterior_covariance
from workbench.fitting.start_states import refit_starts
from workbench.fitting.unknowns import Unknowns
from workbench.fitting.window_cuts import cut_rows, evenly
from workbench.fitting.windows import Windows
from workbench.manoeuvres.play import Manoeuvre, Play
from workbench.manoeuvres.rehearse import SpeedMap
from workbench.recording import Recording

STEPS = 4  # of start states

Near = tuple[Linearised, tuple[Windows, Unknowns]]  # derivatives and what they belong to


@dataclass(frozen=True)
class Rehearsed:
    """One manoeuvre and what each rival would record of it, in the rivals' order.

    ``maps`` are the speed maps of the axes in the loop, that of the likeliest rival.
    """

    manoeuvre: Manoeuvre
    play: Play
    recorded: tuple[Recording, ...]
    maps: tuple[SpeedMap, ...] = ()


def distances(
    fits: Sequence[Fit],
    rehearsed: Sequence[Rehearsed],
    most: int | None = None,
    pairs: Iterable[tuple[int, int]] | None = None,
    settled: bool = False,
) -> np.ndarray:
    """T of each manoeuvre for each pair of rivals, shape (n_manoeuvres, n_pairs).

    ``fits`` are the rivals, the likeliest first; the typical errors of that one weigh residuals.
    ``most`` bounds the windows of each manoeuvre; T counts as of all.  Of each of the ``pairs`` the
    first is to explain what the second would record; by default all combinations of two, in order.
    With ``settled`` start states are fitted before the linear model is made: across a break-away it
    holds nowhere, and rivals seem ten times as far apart in a slow triangle as they are.
    """
    errors = fits[0].windows.rescaled(fits[0].residual)
    columns: list[list[float]] = []
    near: Near | None = None
    precisions: dict[int, np.ndarray] = {}
    for k, j in pairs or combinations(range(len(fits)), 2):
        fit = fits[k]
        if k not in precisions:
            precisions[k] = np.linalg.inv(posterior_covariance(fit))
        both = [(each.recorded[j], each.recorded[k]) for each in rehearsed]
        windows, of_all = _windows(fit, both, most)
        windows = windows.scaled_like(errors)
        at = _settled(windows, fit) if settled else _derivatives(windows, fit, near)
        near = near or (at, (windows, fit.unknowns))
        owner = np.repeat(np.arange(len(rehearsed)), [len(own) for own in windows.firsts])
        recorded = (windows.weight > 0).sum(axis=2)
        most_chi2 = OUTLYING**2 * np.sum(recorded / windows.correlation, axis=0)
        columns.append(
            [
                distance(at.part(owner == m), precisions[k], most_chi2[owner == m], of_all)
                for m in range(len(rehearsed))
            ]
        )
    return np.array(columns).T


def _derivatives(windows: Windows, fit: Fit, near: Near | None) -> Linearised:
    """Residuals and derivatives of a rival; its nuisances act nearly as those of the first one.

    One that lacks a state of the first, such as the lag that is its rival, has all its own.
    """
    point = Point(fit.point.t, windows.start)
    if near is None or not set(near[1][0].plant.state_list) <= set(windows.plant.state_list):
        return linearise(windows, fit.unknowns, point)
    return borrowed(*near, windows, fit.unknowns, point)


def _settled(windows: Windows, fit: Fit) -> Linearised:
    """Residuals and derivatives where a rival's start states fit best, at its own parameters."""
    starts = refit_starts(windows, fit.plant.values, iterations=STEPS).point.starts
    return linearise(windows, fit.unknowns, Point(fit.point.t, starts))


def distance(at: Linearised, precision: np.ndarray, most: np.ndarray, of_all: float = 1.0) -> float:
    """T of the module's equation; ``precision`` (n_p, n_p) holds the scaled parameters.

    ``most`` is the chi2 up to which each window counts, (n_windows,), as in a fit: far beyond the
    typical error of a model more says nothing.  ``of_all`` is how many windows each one stands for.
    """
    r = at.projected(at.residual[:, :, None])[:, :, 0]
    counted = np.minimum(1.0, np.sqrt(most / np.maximum(np.sum(r**2, axis=1), 1e-300)))[:, None]
    J = (counted[:, :, None] * at.projected(at.parameters)).reshape(r.size, -1)
    r = (counted * r).ravel()
    g = of_all * (J.T @ r)
    return float(of_all * (r @ r) - g @ np.linalg.solve(of_all * (J.T @ J) + precision, g))


def _windows(
    fit: Fit, pairs: Sequence[tuple[Recording, Recording]], most: int | None
) -> tuple[Windows, float]:
    """What others would record as windows of a rival's plant, and how many each one stands for.

    ``pairs`` hold for each manoeuvre what the other one and what the rival itself would record:
    windows start where the other one is, as its sensors show it, and states that it does not have
    where the rival itself would be.
    """
    like, length = fit.windows, fit.windows.length
    states = list(like.plant.state_list)
    whole = np.arange(len(pairs[0][0]) // length)
    kept = whole if most is None or most >= len(whole) else evenly(len(whole), most)
    firsts = tuple(int(k) * length for k in kept)
    sampled = _sampled(like, len(pairs[0][0]))
    measured = [
        cut_rows(np.where(sampled, other.rows(like.plant.measured), np.nan), firsts, length)
        for other, _ in pairs
    ]
    sources = [[a if name in a.channels else b for name in states] for a, b in pairs]
    start = [
        np.reshape([s[name][list(firsts)] for s, name in zip(each, states, strict=True)],
                   (len(states), len(firsts)))
        for each in sources
    ]  # fmt: skip
    deviation = np.median(like.start_deviation, axis=1, keepdims=True)
    count = len(pairs) * len(firsts)
    found = replace(
        like,
        recordings=tuple(other for other, _ in pairs),
        firsts=(firsts,) * len(pairs),
        measured=np.concatenate(measured, axis=1),
        start=np.concatenate(start, axis=1),
        start_deviation=np.tile(deviation, (1, count)),
        scale=np.ones((len(like.plant.measured), count)),
    )
    return found, len(whole) / len(kept)


def _sampled(like: Windows, count: int) -> np.ndarray:
    """True where a sensor as slow as so far would give one of so many samples, (n_y, count)."""
    found = np.zeros((len(like.plant.measured), count), dtype=bool)
    for row, name in zip(found, like.plant.measured, strict=True):
        so_far = np.concatenate([each[name] for each in like.recordings])
        row[:: usual_gap(np.isfinite(so_far))] = True
    return found

"""What two effects would explain together that neither explains alone, by linear algebra alone.

The scan has run every size and shape of every candidate.  With d_i what trial i does to the
projected residual r and M the nuisance-free metric of :mod:`workbench.diagnosis.scan`, amounts a, b
of two trials cost

    c(a, b) = c(0) + 2 (a d_i + b d_j)'M r + (a d_i + b d_j)'M (a d_i + b d_j)

with a and b between none and what the bounds of their strengths allow.  The drop of a pair of
effects is the largest over the trials of both, so their signs and shapes are those of the scan; its
gain is what it takes more than the better one of the two.  All pairs of trials share one Gram
matrix.

Source: diagnosis.md 1.4 and 1.10 (M-projected Gram matrices).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product
from math import nan

import numpy as np

from workbench.candidate import together
from workbench.diagnosis.metric import Metric, every_second
from workbench.diagnosis.scan import Profile, Trial
from workbench.effect import Parameter
from workbench.fitting.problem import Problem

FURTHEST = 3.0  # times a size of the scan: beyond it its change is not known
LEAST_AMOUNT = 0.1  # of a size: a start at none would stay there
FACTORS = (1.0, 0.3, 3.0)  # on the amounts of the linear step, for the starts of a refit
INDEPENDENT = 1e-3  # 1 - cos^2 of two changes: below it they are one


@dataclass(frozen=True)
class Gain:
    """A pair by the linear model: as a profile to begin a fit with, and what it takes together.

    drop    fall of the projected cost with both
    gain    of that, what the better one alone does not bring
    """

    profile: Profile
    drop: float
    gain: float


def pair_gains(
    problem: Problem, profiles: Sequence[Profile], least: float = 0.0, most: int = 1
) -> list[Gain]:
    """The pairs that take most together, best first, with a gain of more than ``least``.

    At most ``most`` of them; none where there are fewer than two effects.
    """
    if len(profiles) < 2:
        return []
    base = problem.base
    _, _, metric, of_all = every_second(base.windows, base.unknowns, base.point, problem.linearised)
    known = problem.whole.parameters
    owner = np.repeat(np.arange(len(profiles)), [len(each.trials) for each in profiles])
    gram, slope = metric.gram(np.concatenate([each.changes for each in profiles]))
    room = np.array([_room(known[t.candidate.strength], t) for p in profiles for t in p.trials])
    amounts, drop = joint_drops(gram, slope, room)
    alone = [
        max(of_all * np.diag(drop)[owner == k].max(), each.drop) for k, each in enumerate(profiles)
    ]
    found = []
    for one, other in combinations(range(len(profiles)), 2):
        block = np.where(np.outer(owner == one, owner == other), drop, -np.inf)
        i, j = (int(k) for k in np.unravel_index(block.argmax(), block.shape))
        whole = float(of_all * drop[i, j])
        if whole - max(alone[one], alone[other]) > least:
            found.append((whole, whole - max(alone[one], alone[other]), i, j))
    found.sort(reverse=True)
    rows = [(p, k) for p in profiles for k in range(len(p.trials))]
    return [
        Gain(_profile(problem, metric, of_all, [rows[i], rows[j]], amounts[[i, j], [j, i]]), *drops)
        for *drops, i, j in found[:most]
    ]


def joint_drops(
    gram: np.ndarray, slope: np.ndarray, room: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(amounts, drops) of every pair of changes, each (n, n), with amounts from 0 to ``room`` (n,).

    Row i, column j of the amounts is how much of i goes with j.  On the diagonal stands each change
    alone.  The cost is a parabola in two amounts: its lowest point is inside the rectangle or on
    one of its edges.
    """
    g_i, g_j = np.diag(gram)[:, None], np.diag(gram)[None, :]
    b_i, b_j, top_i, top_j = slope[:, None], slope[None, :], room[:, None], room[None, :]

    def lowest(g: np.ndarray, b: np.ndarray, top: np.ndarray) -> np.ndarray:
        return np.clip(-b / np.maximum(g, 1e-300), 0.0, top)

    left = g_i * g_j - gram**2
    apart = left > INDEPENDENT * g_i * g_j
    left = np.where(apart, left, 1.0)
    inside = (b_j * gram - b_i * g_j) / left
    other = inside.T
    sound = apart & (inside >= 0) & (inside <= top_i) & (other >= 0) & (other <= top_j)
    amount, drop = np.zeros_like(gram), np.zeros_like(gram)
    for end in (np.zeros_like(top_i), top_i):
        second = lowest(g_j, b_j + end * gram, top_j)
        first = end + np.zeros_like(gram)
        amount, drop = _better(amount, drop, first, _fall(gram, slope, first, second))
        amount, drop = _better(amount, drop, second.T, _fall(gram, slope, second.T, first.T))
    inside, other = np.where(sound, inside, 0.0), np.where(sound, other, 0.0)
    amount, drop = _better(amount, drop, inside, _fall(gram, slope, inside, other))
    alone = lowest(np.diag(gram), slope, room)
    np.fill_diagonal(amount, alone)
    np.fill_diagonal(drop, -2 * alone * slope - alone**2 * np.diag(gram))
    return amount, drop


def _fall(gram: np.ndarray, slope: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """How far the cost falls with these amounts of row and column, (n, n)."""
    own = np.diag(gram)
    linear = first * slope[:, None] + second * slope[None, :]
    square = first**2 * own[:, None] + 2 * first * second * gram + second**2 * own[None, :]
    return -2 * linear - square


def _better(
    amount: np.ndarray, drop: np.ndarray, tried: np.ndarray, fall: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    return np.where(fall > drop, tried, amount), np.maximum(drop, fall)


def _room(known: Parameter, trial: Trial) -> float:
    """How much of a trial its strength's bounds allow."""
    null = known.null or 0.0
    away = trial.values[trial.candidate.strength] - null
    end = known.upper if away > 0 else known.lower
    return float(min((end - null) / away, FURTHEST))


def _profile(
    problem: Problem,
    metric: Metric,
    of_all: float,
    rows: Sequence[tuple[Profile, int]],
    amounts: np.ndarray,
) -> Profile:
    """A pair as a profile: the linear step first, then more and less of each."""
    pair = together(*(profile.candidate for profile, _ in rows))
    changes = np.array([profile.changes[k] for profile, k in rows], dtype=float)
    trials = []
    for factors in product(FACTORS, FACTORS):
        shares = [f * max(a, LEAST_AMOUNT) for f, a in zip(factors, amounts, strict=True)]
        values: dict[str, float] = {}
        for (profile, k), share in zip(rows, shares, strict=True):
            values |= _scaled(problem, profile.trials[k], share)
        row = metric.normal.residual.ravel() + np.array(shares) @ changes
        cost, step = metric.explained(row)
        trials.append(Trial(pair, values, shares[0], of_all * (metric.cost - cost), nan, step))
    signature, share = metric.signature(-amounts @ changes)
    return Profile(pair, tuple(trials), signature, share, np.outer(1.0, amounts) @ changes)


def _scaled(problem: Problem, trial: Trial, share: float) -> dict[str, float]:
    """The values of a trial with a share of its strength, within its bounds."""
    name = trial.candidate.strength
    known = problem.whole.parameters[name]
    null = known.null or 0.0
    size = null + share * (trial.values[name] - null)
    return {**trial.values, name: float(np.clip(size, known.lower, known.upper))}

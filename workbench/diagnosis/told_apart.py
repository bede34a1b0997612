"""What recordings tell apart after all: one of a tie leaves their noise, another far more.

Drops are weighed by what is typical of the model without any of them, and next to its errors a
tenth that is left is little.  Next to the noise it is not: where the settled fit with one effect
leaves hardly more than that, and the one with another clearly more on training and on held-out
recordings, no recording is needed to tell them apart.  Nothing is said where all leave more: then
something else is there too, and who leaves less of that may be the wrong one.

The level of a set is the geometric mean over outputs of their error over their noise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from workbench.diagnosis.ranking import grouped
from workbench.diagnosis.result import Ranked
from workbench.diagnosis.settle import on_its_own_yardstick
from workbench.fitting.errors import penalised_rmse
from workbench.fitting.gauss_newton import Fit

NEAR_NOISE = 1.5  # level of what explains a recording
CLEARLY_MORE = 1.5  # times that level


def told_apart(ranking: tuple[Ranked, ...]) -> tuple[Ranked, ...]:
    """The ranking, out of its tie what leaves clearly more than one that leaves the noise.

    Rows are settled.  Where the leader falls out, the one that leaves least comes first.
    """
    leader = ranking[0]
    names = {leader.candidate.name, *leader.alike}
    group = [row for row in ranking if row.candidate.name in names]
    if len(group) < 2 or any(row.fit is None or row.validation is None for row in group):
        return ranking
    own = [on_its_own_yardstick(row) for row in group]
    levels = [_levels(row) for row in own]
    best = min(range(len(group)), key=lambda k: sum(levels[k].values()))
    if not group[best].accepted or max(levels[best].values()) > np.log(NEAR_NOISE):
        return ranking
    stays = [k for k, each in enumerate(levels) if not _clearly_more(each, levels[best])]
    if 0 not in stays:
        group[best] = own[best]  # as a leader is told
        stays.sort(key=lambda k: k != best)
    kept = [_only(group[k], {group[j].candidate.name for j in stays}) for k in stays]
    left = [_only(row, set()) for k, row in enumerate(group) if k not in stays]
    others = [row for row in ranking if row.candidate.name not in names]
    return (*grouped(kept), *left, *others)


def _levels(row: Ranked) -> dict[str, float]:
    """Logarithm of the level of either set."""
    return {"train": _level(row.fit), "validation": _level(row.validation)}


def _level(fit: Fit) -> float:
    """The same of one; below the noise is at it, and what could not be simulated is penalised."""
    recorded = np.isfinite(fit.windows.measured).any(axis=(1, 2))
    over_noise = penalised_rmse(fit)[recorded] / fit.windows.noise[recorded]
    return float(np.mean(np.log(np.maximum(over_noise, 1.0))))


def _clearly_more(one: Mapping[str, float], best: Mapping[str, float]) -> bool:
    return all(one[where] > best[where] + np.log(CLEARLY_MORE) for where in best)


def _only(row: Ranked, names: set[str]) -> Ranked:
    """The row with no tie but with these."""
    shares = {name: share for name, share in row.imitated_by.items() if name in names}
    return replace(row, tied_with=(), crowd=(), imitated_by=shares)

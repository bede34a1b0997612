"""The calls of a controller in one run: how long they took, and how many it had no answer to.

Where a solver fails, an answer comes too late or an estimate is no number, a controller sends what
it had planned before, or what it starts with.  A loop that does so all along may look calm.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.closed_loop import LoopRecord


@dataclass(frozen=True, kw_only=True)
class Answered:
    """What every row of a check has of its controller's answers.

    control_samples     how often it was asked
    fallback_samples    how often it had no answer, and ran on its fallback
    """

    control_samples: float = 0.0
    fallback_samples: float = 0.0


def calls(record: LoopRecord) -> dict[str, float]:
    """Fields of a row: wall times of controller and estimator, and :class:`Answered`."""
    return {
        "solve_median_s": float(np.median(record.control_time_s)),
        "solve_p99_s": float(np.percentile(record.control_time_s, 99)),
        "control_samples": float(len(record.fallback)),
        "fallback_samples": float(np.count_nonzero(record.fallback)),
    }


def fallbacks(rows: Iterable[Any]) -> Iterator[str]:
    """A sentence for each row whose controller did not always have an answer."""
    for row in rows:
        if row.fallback_samples:
            beside = getattr(row, "estimator", "")
            loop = f"{row.scenario} with {row.design}" + (f" and {beside}" if beside else "")
            count = f"{row.fallback_samples:.0f} of {row.control_samples:.0f} samples"
            yield f"the controller had no answer, and ran on its fallback, in {count} of {loop}"

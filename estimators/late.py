"""Measurements that arrive late, for any estimator: what is known of a sample is put where it was.

An output may be late by a whole number of samples, each by its own.  The last samples are kept;
when a late value arrives, the estimates since then are worked out again with it.  That is exact,
and it is what a filter would have said with all values in time, carried on by the commands.  An
estimator is a fold, so going back is to take up an older value.

Source: Larsen et al. 1998, "Incorporation of time delayed measurements in a discrete-time Kalman
filter" (their reference method, by recalculation).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from estimators.wrapped import Wrapped
from workbench.contracts import Estimate


@dataclass(frozen=True)
class _Sample:
    """The estimate before a sample, the command since then, and what is known of the outputs."""

    before: Estimate
    command: np.ndarray
    known: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Late(Wrapped):
    """Any estimator with outputs that are late by ``samples``, by name; others are in time."""

    samples: Mapping[str, int]

    def __post_init__(self) -> None:
        unknown = [name for name in self.samples if name not in self.inner.plant.measured]
        if unknown or min(self.samples.values(), default=0) < 0:
            known = ", ".join(self.inner.plant.measured)
            raise ValueError(f"late outputs need whole samples from 0 on, for some of {known}")

    def start(self, measurement: np.ndarray) -> Estimate:
        begun = self.inner.start(measurement)
        return replace(begun, memory=(begun, ()))

    def update(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Estimate:
        newest, kept = last.memory
        nothing = np.full(len(measurement), np.nan)
        samples = [*kept, _Sample(newest, command, nothing)]
        for row, name in enumerate(self.plant.measured):
            back = self.samples.get(name, 0)
            if back < len(samples):
                place = len(samples) - 1 - back
                known = samples[place].known.copy()
                known[row] = measurement[row]
                samples[place] = replace(samples[place], known=known)
        now, chain = samples[0].before, []
        for sample in samples:
            chain.append(replace(sample, before=now))
            now = self.inner.update(now, sample.command, sample.known)
        latest = max(self.samples.values(), default=0)
        return replace(now, memory=(now, tuple(chain[max(len(chain) - latest, 0) :])))

"""An outlier gate before any estimator: a measurement that cannot be is taken as not received.

An output is left out where it lies further from what is foreseen than so many standard deviations
of its innovation.  A sensor that has come back after a jump must be believed again, so that not
more than ``patience`` samples in a row are left out.

To know what is foreseen costs a second update.  It is saved where an estimator notes its innovation
squared over its covariance, ``nis``, and that is inside the gate: no output alone is then outside.

Source: Bar-Shalom, Li and Kirubarajan 2001, "Estimation with applications to tracking and
navigation", Sec. 1.5 (validation gate), output by output.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import inf

import numpy as np

from estimators.foreseen import Foresight
from estimators.wrapped import Wrapped
from workbench.contracts import Estimate


@dataclass(frozen=True, kw_only=True)
class Gated(Wrapped):
    """Any estimator behind a gate; the note ``outliers`` counts what was left out of a sample."""

    deviations: float = 5.0
    patience: int = 20

    def start(self, measurement: np.ndarray) -> Estimate:
        begun = self.inner.start(measurement)
        return replace(begun, memory=(begun, np.zeros(len(measurement), dtype=int)))

    def update(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Estimate:
        before, in_a_row = last.memory
        now = self._unsuspected(before, command, measurement)
        out = np.zeros(len(measurement), dtype=bool)
        if now is None:
            y, S = self._sight.outputs(self._sight.blind(before, command), command)
            with np.errstate(invalid="ignore"):
                far = np.abs(measurement - y) > self.deviations * np.sqrt(np.diag(S))
            out = far & (in_a_row < self.patience)
            now = self.inner.update(before, command, np.where(out, np.nan, measurement))
        seen = np.isfinite(measurement)
        in_a_row = np.where(out, in_a_row + 1, np.where(seen, 0, in_a_row))
        notes = {**now.notes, "outliers": float(out.sum())}
        return replace(now, memory=(now, in_a_row), notes=notes)

    def _unsuspected(
        self, before: Estimate, command: np.ndarray, measurement: np.ndarray
    ) -> Estimate | None:
        """The estimate with every output in it, where its ``nis`` shows that none is far off."""
        if "nis" not in before.notes:
            return None
        now = self.inner.update(before, command, measurement)
        return now if now.notes.get("nis", inf) <= self.deviations**2 else None

    @cached_property
    def _sight(self) -> Foresight:
        return Foresight(self.inner)

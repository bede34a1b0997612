"""Signals under way between plant and computer, sample by sample."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.effect import Effect
from workbench.effects.timing import sent_at_s


class Arrivals:
    """What is sent at each sample, and what of it has arrived through the causes in time.

    ``before``, shape (n_signals,), is what was there before the first sample; without it the first
    sample is.
    """

    def __init__(
        self,
        members: Sequence[Effect],
        names: Sequence[str],
        n: int,
        sample_time_s: float,
        before: np.ndarray | None = None,
    ) -> None:
        time_s = sample_time_s * np.arange(n)
        sent_s = [sent_at_s(members, name, time_s) for name in names]
        place = np.reshape(sent_s, (len(names), n)) / sample_time_s + 1.0  # row 0 is before
        self._place = np.clip(place, 0.0 if before is not None else 1.0, None)
        self._sent = np.zeros((n + 2, len(names)))
        self._column = np.arange(len(names))
        self._at_once = bool(np.all(self._place == 1.0 + np.arange(n)))
        if before is not None:
            self._sent[0] = before

    def __call__(self, values: np.ndarray, k: int) -> np.ndarray:
        """What arrives at sample k, where ``values`` are sent; both of shape (n_signals,)."""
        if self._at_once:
            return values
        self._sent[k + 1 :] = values
        first = np.floor(self._place[:, k] + 1e-9).astype(int)
        share = np.clip(self._place[:, k] - first, 0.0, 1.0)
        older, newer = self._sent[first, self._column], self._sent[first + 1, self._column]
        return (1.0 - share) * older + share * newer

"""Misfits by replayed windows, for the truth of any plant.

Windows (0.5 s at 1 kHz) are replayed with the recorded command from the true state at their start,
once as it was, once without the hidden effect, once without each difference.  The misfit is the
mean squared deviation of the outputs over the noise variance.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from studies.truth.batch import join, stack
from studies.truth.case import Case
from studies.truth.rule import Misfit

WINDOW_SAMPLES = 500
STARTS = tuple(range(500, 9500, 1000))
REPLAY_SUBSTEPS = 25  # enough for differences of two replays
LARGEST_BATCH = 2500  # columns; more does not fit the cache


@dataclass(frozen=True)
class Replay:
    """How the windows of one plant are replayed.

    plant      true plant of a case; the name of a field whose difference is off, "hidden", or ""
    start      state of one column once per name
    outputs    batch, commands (n_samples, n_columns) and states to outputs over their noise, of
               shape (n_outputs, n_samples, n_columns)
    starts     first sample of every window
    samples    length of a window
    """

    plant: Callable[[Case, str], Any]
    start: Callable[[Any, int, Case, Sequence[str]], Any]
    outputs: Callable[[Any, np.ndarray, Any], np.ndarray]
    starts: Sequence[int] = STARTS
    samples: int = WINDOW_SAMPLES

    def misfits(
        self, cases: Sequence[Case], states: dict[int, Any], command: np.ndarray
    ) -> list[Misfit]:
        """One misfit per case, from states at `starts` and commands, both with a column per case.

        The columns are replayed in groups that fit the cache.
        """
        per_case = 2 + max(len(c.differences) for c in cases)
        group = max(1, LARGEST_BATCH // (per_case * len(self.starts)))
        found = []
        for first in range(0, len(cases), group):
            members = range(first, min(first + group, len(cases)))
            found += self._of_group(cases, states, command, members)
        return found

    def _of_group(self, cases, states, command, members: Iterable[int]) -> list[Misfit]:
        """Replay all windows of some cases; columns are ordered case, window, variant."""
        plants, starts, commands, variants = [], [], [], []
        for i in members:
            names = ["", "hidden", *(x.field for x in cases[i].differences)]
            variants.append(names)
            for start in self.starts:
                plants += [self.plant(cases[i], name) for name in names]
                starts.append(self.start(states[start], i, cases[i], names))
                window = command[start : start + self.samples, i]
                commands.append(np.repeat(window[:, None], len(names), axis=1))
        outputs = self.outputs(stack(plants), np.concatenate(commands, axis=1), join(starts))
        found, column = [], 0
        for names in variants:
            width = len(names) * len(self.starts)
            block = outputs[:, :, column : column + width]
            block = block.reshape(*block.shape[:2], len(self.starts), len(names))
            value = np.mean((block - block[..., :1]) ** 2, axis=(0, 1, 2)).tolist()
            found.append(Misfit(value[1], dict(zip(names[2:], value[2:], strict=True))))
            column += width
        return found

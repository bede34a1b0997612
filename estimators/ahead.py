"""An estimator for a plant whose commands arrive late: it hands on the state they will meet."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from workbench.contracts import Estimate
from workbench.filtering import consistent_start
from workbench.plant import Plant
from workbench.simulation import command_delay_s


@dataclass(frozen=True, kw_only=True)
class Ahead:
    """Any estimator, told the delayed commands, and its state carried on by those under way.

    What is handed on is the state at t + delay, where the command worked out from it will act; the
    covariance is the one at t.  The memory is the inner estimate and the last commands.

    Source: Smith 1957, "Closer control of loops with dead time", in its state-space form.
    """

    inner: Any
    plant: Plant
    delay_s: float

    @property
    def sample_time_s(self) -> float:
        return self.inner.sample_time_s

    def start(self, measurement: np.ndarray) -> Estimate:
        begun = self.inner.start(measurement)
        kept = int(np.ceil(self.delay_s / self.sample_time_s)) + 2
        return replace(begun, memory=(begun, (self.plant.nominal[0],) * kept))

    def update(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Estimate:
        before, sent = last.memory
        sent = (*sent[1:], command)
        late = self.delay_s / self.sample_time_s
        now = self.inner.update(before, self._at(sent, -late), measurement)
        step, (_, d, p) = self.plant.model.step(self.sample_time_s), self.plant.nominal
        x, places = self._whole(now)
        for k in range(1, round(late) + 1):
            x = step(x, self._at(sent, k - late), d, p).full().ravel()
        return replace(now, state=x[places], memory=(now, sent))

    def _whole(self, now: Estimate) -> tuple[np.ndarray, list[int]]:
        """The plant's state with what is estimated, and the places of that; the rest follows."""
        states = self.plant.model.states
        places = [states.index(name) for name in now.names]
        if len(places) == len(states):
            return now.state, places
        x = consistent_start(self.plant, dict(zip(now.names, now.state, strict=True)))
        x[places] = now.state
        return x, places

    @staticmethod
    def _at(sent: tuple[np.ndarray, ...], samples: float) -> np.ndarray:
        """The command sent so many samples after the newest, between samples by interpolation."""
        index = np.arange(len(sent)) - (len(sent) - 1)
        return np.array([np.interp(samples, index, column) for column in np.array(sent).T])


def in_time(estimator: Any, plant: Plant) -> Any:
    """The estimator itself, or looking ahead where a command of the plant is delayed.

    Of several commands the one that is delayed most counts.
    """
    delay_s = command_delay_s(plant)
    return Ahead(inner=estimator, plant=plant, delay_s=delay_s) if delay_s else estimator

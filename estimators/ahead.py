"""An estimator for a plant whose commands arrive late: it hands on the state they will meet.

A state that is handed on early has to be held against the reference of its own time, else the loop
is as late as it looks ahead; so the estimate says how far ahead it is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from workbench.contracts import Estimate
from workbench.filtering import consistent_start
from workbench.plant import Plant
from workbench.simulation import command_delay_s, output_delay_s

SLACK = 1e-6  # of a sample: delays are multiples of it up to rounding


@dataclass(frozen=True, kw_only=True)
class Ahead:
    """Any estimator, told the delayed commands, and its state carried on by those under way.

    What is handed on is the state at t + delay, where the command worked out from it will act; the
    covariance is the one at t.  The memory is the inner estimate and the last commands.  Outputs
    that come late, by ``sensors_s``, are not foreseen: they leave the state behind by that.

    Source: Smith 1957, "Closer control of loops with dead time", in its state-space form.
    """

    inner: Any
    plant: Plant
    delay_s: float
    sensors_s: float = 0.0

    @property
    def sample_time_s(self) -> float:
        return self.inner.sample_time_s

    def start(self, measurement: np.ndarray) -> Estimate:
        begun = self.inner.start(measurement)
        kept = int(np.ceil(self.delay_s / self.sample_time_s)) + 2
        return self._handed_on(begun, begun.state, (begun, (self.plant.nominal[0],) * kept))

    def update(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Estimate:
        before, sent = last.memory
        sent = (*sent[1:], command)
        late = self.delay_s / self.sample_time_s
        now = self.inner.update(before, self._at(sent, -late), measurement)
        own = set(now.names) - set(self.plant.model.states)
        carried = self._by_the_estimator if own else self._by_the_plant
        return self._handed_on(now, carried(now, sent, late), (now, sent))

    def _handed_on(self, now: Estimate, state: np.ndarray, memory: Any) -> Estimate:
        return replace(now, state=state, memory=memory, ahead_s=self.delay_s - self.sensors_s)

    def _by_the_plant(self, now: Estimate, sent: tuple[np.ndarray, ...], late: float) -> np.ndarray:
        """The state so many samples later, between two samples too."""
        step, (_, d, p), (x, places) = self.plant.model.step, self.plant.nominal, self._whole(now)
        whole = int(late + SLACK)
        for k in range(1, whole + 1):
            x = step(self.sample_time_s)(x, self._at(sent, k - late), d, p).full().ravel()
        if late - whole > SLACK:
            rest_s = self.delay_s - whole * self.sample_time_s
            x = step(rest_s)(x, sent[-1], d, p).full().ravel()
        return x[places]

    def _by_the_estimator(
        self, now: Estimate, sent: tuple[np.ndarray, ...], late: float
    ) -> np.ndarray:
        """Of one with states that the plant does not have: it predicts, by the nearest sample."""
        nothing = np.full(len(self.plant.measured), np.nan)
        for k in range(1, int(late + 0.5) + 1):
            now = self.inner.update(now, self._at(sent, k - late), nothing)
        return now.state

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
    """The estimator itself, or looking ahead where a signal of the plant is delayed.

    Of several commands, and of several outputs, the one that is delayed most counts.
    """
    delay_s, sensors_s = command_delay_s(plant), output_delay_s(plant)
    if not (delay_s or sensors_s):
        return estimator
    return Ahead(inner=estimator, plant=plant, delay_s=delay_s, sensors_s=sensors_s)

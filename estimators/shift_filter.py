"""An extended Kalman filter of a gearbox actuator on four states: both pressures, place and speed.

What the valves pass follows from the commands that were sent, see :mod:`linearize.valve_response`;
contacts are no part of it, so that its step is a millisecond and its covariance stays well behaved.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from linearize.shift_sample import half_stroke_m, one_sample, softened
from linearize.shifting import STATES, VELOCITY
from linearize.valve_response import MASK, ValveResponse, valve_response
from workbench.called import called
from workbench.compiled import compiled
from workbench.contracts import Estimate
from workbench.filtering import correct, predict
from workbench.plant import Plant

VALVES = ("valve_1", "valve_2")
HOLD = 3  # samples: least time between two switches of a valve that it follows
START_M_S = 0.01


@dataclass(frozen=True, kw_only=True)
class ShiftFilter:
    """Predict with the reduced model, correct with pressures and position; it starts at rest.

    Attributes
    ----------
    measurement_noise
        Standard deviation of both pressures and of the position, by name.
    process_noise
        Standard deviation that each of the four states gains per square root of a second.
    """

    plant: Plant
    sample_time_s: float
    measurement_noise: Mapping[str, float]
    process_noise: Mapping[str, float]

    def start(self, measurement: np.ndarray) -> Estimate:
        known = dict(zip(self.plant.measured, measurement, strict=True))
        x = np.array([known.get(name, 0.0) for name in STATES])
        first = {**self.measurement_noise, VELOCITY: START_M_S}
        P = np.diag([first[name] ** 2 for name in STATES])
        return Estimate(STATES, x, P, (0, 0))

    def update(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Estimate:
        """One sample; ``command`` is what acted since the last one.

        Raises
        ------
        ValueError
            If a valve has switched twice within three samples.
        """
        sent = tuple((s << 1 | round(u)) & MASK for s, u in zip(last.memory, command, strict=True))
        shares = [r.newest(s) for r, s in zip(self.responses, sent, strict=True)]
        later, F = called(self.sampled, last.state, shares)
        P = predict(last.state, last.covariance, F, self._gained)[1]
        innovation = np.array(measurement) - later.ravel()[self._rows]
        H, R = np.eye(len(STATES))[self._rows], self._noise
        x, P = correct(later.ravel(), P, innovation, H, R)
        return Estimate(STATES, x, P, sent)

    @cached_property
    def sampled(self) -> ca.Function:
        """(x, shares) -> (x one sample later, its derivative in x)."""
        model = softened(self.plant)
        step = one_sample(model, half_stroke_m(self.plant), self.sample_time_s, stops=True)
        x, share = ca.SX.sym("x", len(STATES)), ca.SX.sym("share", len(VALVES))
        later = step(x, share)[0]
        return compiled(ca.Function("sampled", [x, share], [later, ca.jacobian(later, x)]))

    @cached_property
    def responses(self) -> tuple[ValveResponse, ...]:
        """What each valve passes after its commands."""
        return tuple(valve_response(self.plant, v, self.sample_time_s, HOLD) for v in VALVES)

    @cached_property
    def _rows(self) -> list[int]:
        return [STATES.index(name) for name in self.plant.measured]

    @cached_property
    def _noise(self) -> np.ndarray:
        return np.diag([self.measurement_noise[name] ** 2 for name in self.plant.measured])

    @cached_property
    def _gained(self) -> np.ndarray:
        gained = np.array([self.process_noise[name] for name in STATES])
        return np.diag(gained**2 * self.sample_time_s)

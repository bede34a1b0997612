"""An extended Kalman filter of a gearbox actuator: pressures, place, speed, and its two valves.

What the valves pass follows from the commands that were sent: coil and armature of each are run
beside the filter.  No two valves are the same, so that the strength of each is estimated, from the
instants at which pressures begin to rise and fall, beside the flows' own gain, without which a
leaner flow would be taken for a late valve.  What strength does not tell of a valve is noise while
its seats move.  See :mod:`linearize.valve_spread`.

Both are learned from flows far from their end alone: of a chamber that stands at a supply of
another pressure than the model's they would say that nothing flows.

Contacts are no part of it, so that its step is a millisecond and its covariance stays well behaved.

Source: Särkkä 2013, "Bayesian filtering and smoothing", ch. 5 (the extended filter) and 12.3
(parameters as states).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np

from linearize.shift_sample import half_stroke_m, one_sample, softened
from linearize.shifting import PRESSURES, STATES, VELOCITY
from linearize.valve_sample import VALVES, ends_pa
from linearize.valve_spread import (
    FLOW_GAINS,
    STRENGTHS,
    UncertainValve,
    passed,
    uncertain_valve,
)
from workbench.called import prepared
from workbench.compiled import compiled
from workbench.contracts import Estimate
from workbench.filtering import consistent_start, correct, predict
from workbench.plant import Plant

NAMES = (*STATES, *STRENGTHS, *FLOW_GAINS)
START_M_S = 0.01
FLOW_GAIN = 0.07  # deviation before anything is seen
FORGOTTEN_S = 1.0  # in which what was learned of valves fades: a coil warms, a supply falls
NO_CHARGE, NO_VENT = 0.75, 1.5  # pressure over that of supply and atmosphere: nothing is learned
WITHIN = (0.15, 0.5)  # ratios within which it is learned in part
DIRECTIONS = 4  # in which valves differ, of which the first is estimated


class Moved(NamedTuple):
    """What :class:`linearize.valve_spread.UncertainValve` gives of one sample, flat."""

    later: np.ndarray
    shares: np.ndarray
    gained: np.ndarray
    untold: np.ndarray


@dataclass(frozen=True, kw_only=True)
class ShiftFilter:
    """Predict with the reduced model, correct with pressures and position; it starts at rest.

    It estimates the four states of the model, the strength and the flow gain of each valve.

    Attributes
    ----------
    measurement_noise
        Standard deviation of both pressures and of the position, by name.
    process_noise
        Standard deviation that each of the four states gains per square root of a second.
    strength
        Standard deviation of the strength of a valve before anything is seen: 1 as the plant has
        it, less where its valves were measured or fitted.  What else sets valves apart, and the
        gains of their flows, stay as uncertain as of any valve.
    """

    plant: Plant
    sample_time_s: float
    measurement_noise: Mapping[str, float]
    process_noise: Mapping[str, float]
    strength: float = 1.0

    def __getstate__(self) -> dict[str, object]:
        """Without what another process makes anew."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__}

    def start(self, measurement: np.ndarray) -> Estimate:
        """The state that a measurement tells; what is not received is as at the plant's start."""
        told = dict(zip(self.plant.measured, measurement, strict=True))
        known = {name: value for name, value in told.items() if np.isfinite(value)}
        states = list(self.plant.state_list)
        rows = [states.index(name) for name in STATES]
        x = np.array([*consistent_start(self.plant, known)[rows], *np.zeros(len(self._learned))])
        spread = dict(zip(STATES, self.plant.scale[rows], strict=True))
        spread |= {VELOCITY: START_M_S, **{name: self.measurement_noise[name] for name in known}}
        P = np.diag(np.array([*spread.values(), *self._learned]) ** 2)
        return Estimate(NAMES, x, P, tuple(valve.begun for valve in self.valves))

    def update(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Estimate:
        """One sample; ``command`` is what acted since the last one."""
        moved = [
            Moved(*run(x, np.array([float(u)]), valve.parameters))
            for run, valve, x, u in zip(self._run, self.valves, last.memory, command, strict=True)
        ]
        shares = np.concatenate([each.shares for each in moved])
        gained = np.concatenate([each.gained for each in moved])
        later, F, B = self._sampled(last.state, shares, gained)
        F, B = F.reshape(len(NAMES), -1).T, B.reshape(4, -1).T
        Q = self._gained.copy()
        for valve, each in enumerate(moved):
            untold = B[:, 2 * valve : 2 * valve + 2] @ each.untold.reshape(-1, 2).T
            Q += untold @ untold.T
        P = predict(last.state, last.covariance, F, Q)[1]
        innovation = np.array(measurement) - later[self._rows]
        H, R = self._seen, self._noise
        x, P = correct(later, P, innovation, H, R)
        return Estimate(NAMES, x, P, tuple(each.later for each in moved))

    @cached_property
    def sampled(self) -> ca.Function:
        """(x, shares (4,), what they gain by strength (4,)) -> (x one sample later, slopes).

        Slopes in x and in the shares.
        """
        model = softened(self.plant)
        step = one_sample(model, half_stroke_m(self.plant), self.sample_time_s, stops=True)
        x, shares, gained = (
            ca.SX.sym(name, size)
            for name, size in (("x", len(NAMES)), ("shares", 4), ("gained", 4))
        )
        moving, strengths, gains = ca.vertsplit(x, [0, len(STATES), len(STATES) + 2, len(NAMES)])
        own = ca.DM(np.repeat(np.eye(2), 2, axis=0))  # both shares of a valve have its number
        telling = self._telling(moving)
        opened = passed(
            shares, telling * gained, own @ strengths, telling * (own @ gains), ca.fmin, ca.fmax
        )
        kept = np.exp(-self.sample_time_s / FORGOTTEN_S)
        later = ca.vertcat(step(moving, opened)[0], kept * strengths, kept * gains)
        slopes = (ca.densify(ca.jacobian(later, each)) for each in (x, shares))
        return compiled(ca.Function("sampled", [x, shares, gained], [later, *slopes]))

    def _telling(self, moving: ca.SX) -> ca.SX:
        """By share, 1 where its flow is near the choked one and 0 near its end, shape (4,)."""
        low_pa, high_pa = ends_pa(self.plant)
        found = []
        for name in PRESSURES:
            ratio = moving[STATES.index(name)] / ca.DM([high_pa, low_pa])
            rising = ca.vertcat(NO_CHARGE - ratio[0], ratio[1] - NO_VENT)
            found.append(ca.fmin(ca.fmax(rising / ca.DM(WITHIN), 0.0), 1.0))
        return ca.vertcat(*found)

    @cached_property
    def valves(self) -> tuple[UncertainValve, ...]:
        """What each valve passes after its commands, and those that it might be."""
        return tuple(uncertain_valve(self.plant, v, self.sample_time_s, DIRECTIONS) for v in VALVES)

    @cached_property
    def _sampled(self) -> Callable[..., list[np.ndarray]]:
        return prepared(self.sampled)

    @cached_property
    def _run(self) -> tuple[Callable[..., list[np.ndarray]], ...]:
        return tuple(prepared(valve.step) for valve in self.valves)

    @property
    def _learned(self) -> np.ndarray:
        """Deviations of strengths and flow gains before anything is seen, shape (4,)."""
        return np.repeat([self.strength, FLOW_GAIN], 2)

    @cached_property
    def _rows(self) -> list[int]:
        return [NAMES.index(name) for name in self.plant.measured]

    @cached_property
    def _seen(self) -> np.ndarray:
        return np.eye(len(NAMES))[self._rows]

    @cached_property
    def _noise(self) -> np.ndarray:
        return np.diag([self.measurement_noise[name] ** 2 for name in self.plant.measured])

    @cached_property
    def _gained(self) -> np.ndarray:
        gained = np.array([self.process_noise[name] for name in STATES]) ** 2 * self.sample_time_s
        forgotten = 1.0 - np.exp(-2.0 * self.sample_time_s / FORGOTTEN_S)
        return np.diag([*gained, *forgotten * self._learned**2])

"""The Kalman filter on the hybrid modes of a plant: one linear filter per mode, scheduled.

At every sample the mode is looked up where the estimate and the command lie, as in
:mod:`linearize.hybrid_simulation`, and predicts and corrects with its own F, G, offset, C and D.
In a mode that lasts the covariance goes to the solution of its Riccati equation.  It costs a few
matrix products; what it misses is the plant's curvature between the modes.

Source: Kalman 1960; Särkkä 2013, "Bayesian filtering and smoothing", algorithm 4.1; gain scheduling
as in Rugh and Shamma 2000, "Research on gain scheduling".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from estimators.stochastic_plant import LIKELY
from linearize.holding import whole_point
from linearize.hybrid_simulation import SampledHybrid, sampled_hybrid
from linearize.modes import HybridModel, hybrid_modes
from linearize.shift_modes import resting_modes
from linearize.standard import STANDARD_MODES
from workbench.called import prepared
from workbench.contracts import Estimate
from workbench.filtering import consistent_start, correct, predict
from workbench.plant import Plant

MISSED = {"velocity_m_s": 2.0, "velocity_rad_s": 2.0, "pressure_pa": 1.0}  # shares of a scale


def noise_of_modes(plant: Plant, process_noise: Mapping[str, float]) -> dict[str, float]:
    """Process noise with no less than linear modes miss of a plant that moves through them.

    Noise that suits the nonlinear plant would make this filter sure of a wrong line.  With 1 kPa
    per square root of a second it smooths a pressure for as long as the flow takes to change, and
    a closed loop of the servo drive overshoots by a third; from 10 kPa on it does as with the
    extended filter.  Far from the speed of its modes it needs the share of the velocity.  The
    shares, per square root of a second, are *chosen*.
    """
    sizes = zip(plant.model.states, plant.scale, strict=True)
    least = {n: MISSED.get(n.rpartition(".")[2], 0.0) * float(size) for n, size in sizes}
    return {name: max(process_noise.get(name, 0.0), q) for name, q in least.items() if q} | {
        name: q for name, q in process_noise.items() if not least.get(name)
    }


def noise_for(
    estimator: object, plant: Plant, process_noise: Mapping[str, float]
) -> Mapping[str, float]:
    """What an entry of the registry needs where the plant itself gains this process noise."""
    return noise_of_modes(plant, process_noise) if estimator is ScheduledKalman else process_noise


@dataclass(frozen=True, kw_only=True)
class ScheduledKalman:
    """See the module; the notes hold the index of the mode, ``nis`` and log-likelihood of a sample.

    Attributes
    ----------
    measurement_noise, process_noise, initial_deviation
        As in :class:`estimators.extended_kalman.ExtendedKalman`; noise of states that the modes
        leave out is passed over.
    mode
        Name of a mode that holds throughout, scheduled where it is empty.
    hybrid
        The modes; :func:`standard_bank` of the plant by default.
    """

    plant: Plant
    sample_time_s: float
    measurement_noise: Mapping[str, float]
    process_noise: Mapping[str, float]
    initial_deviation: Mapping[str, float] = field(default_factory=dict)
    mode: str = ""
    hybrid: HybridModel | None = None

    def start(self, measurement: np.ndarray) -> Estimate:
        known = dict(zip(self.plant.measured, measurement, strict=True))
        states = self.plant.model.states
        model = self.sampled.hybrid.model
        x = consistent_start(self.plant, known)[[states.index(name) for name in model.states]]
        sizes = zip(model.states, model.scale, strict=True)
        relative = [self.initial_deviation.get(name, size) / size for name, size in sizes]
        return self._estimate(x, np.diag(np.square(relative)), {"mode": -1.0})

    def update(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Estimate:
        x, P = last.state, last.memory
        z = self._row(x, command)
        k = self._active(z)
        n, size, Q = len(x), self.sampled.hybrid.model.scale, self._step_covariance
        step = self.sampled.steps[k]
        later = self.sampled.stopped(x[None], (step @ z)[None])
        later = self.sampled.jumped(x[None], later)[0]
        F = step[:, :n] * size / size[:, None]
        _, P = predict(x / size, P + Q / 2, F, Q / 2)
        C, offset = self._seen[k]
        behind = self._sent(later, command)
        e = (measurement - C @ np.concatenate([later, behind]) - offset) / self._noise
        H = C[:, :n] * size / self._noise[:, None]
        told = {"mode": float(k)} | self._likely(e, H @ P @ H.T + np.eye(len(e)))
        X, P = correct(later / size, P, e, H, np.eye(len(e)))
        return self._estimate(X * size, P, told)

    def _likely(self, e: np.ndarray, S: np.ndarray) -> dict[str, float]:
        """What is told of an innovation in units of the noise, with covariance S."""
        there = np.isfinite(e)
        e, S, noise = e[there], S[np.ix_(there, there)], self._noise[there]
        nis = float(e @ np.linalg.solve(S, e))
        likely = -0.5 * (nis + np.linalg.slogdet(S)[1] + np.log(2.0 * np.pi * noise**2).sum())
        return {"nis": nis, "received": float(there.sum()), LIKELY: float(likely)}

    def retuned(self, process_noise: Mapping[str, float]) -> ScheduledKalman:
        """The same with other process noise, on the modes that are there already."""
        other = replace(self, process_noise=process_noise)
        for name in ("sampled", "_behind", "_seen"):
            other.__dict__[name] = getattr(self, name)
        return other

    def mode_at(self, x: np.ndarray, command: np.ndarray) -> int:
        """Index of the mode at a state of the modes under a command as sent."""
        return self._active(self._row(x, command))

    def _row(self, x: np.ndarray, command: np.ndarray) -> np.ndarray:
        return np.concatenate([x, self._sent(x, command), [1.0]])

    def _sent(self, x: np.ndarray, command: np.ndarray) -> np.ndarray:
        """Commands of the modes, behind the dead zone."""
        return self._behind(*(np.ascontiguousarray(each, dtype=float) for each in (x, command)))[0]

    def _active(self, z: np.ndarray) -> int:
        if not self.mode:
            return int(self.sampled.active(z[None])[0])
        return [m.name for m in self.sampled.hybrid.modes].index(self.mode)

    def _estimate(self, x: np.ndarray, P: np.ndarray, told: Mapping[str, float]) -> Estimate:
        model = self.sampled.hybrid.model
        covariance = P * np.outer(model.scale, model.scale)
        return Estimate(model.states, x, covariance, P, told)

    @cached_property
    def sampled(self) -> SampledHybrid:
        """The modes at samples.

        Raises
        ------
        KeyError
            If the mode that is to hold is not among them.
        """
        hybrid = self.hybrid or standard_bank(self.plant)
        if self.mode:
            _ = hybrid[self.mode]
        return sampled_hybrid(hybrid, self.sample_time_s)

    @cached_property
    def _behind(self) -> Callable[..., list[np.ndarray]]:
        """(x, u as sent) -> u of the modes, behind the dead zone."""
        model = self.sampled.hybrid.model
        return prepared(replace(model, plant=self.plant.lean()).quantities(*model.commands))

    @cached_property
    def _seen(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """[C D] and offset of the outputs of every mode: y = [C D] (x, u) + offset."""
        hybrid = self.sampled.hybrid
        model, n, found = hybrid.model, len(hybrid.model.states), []
        for mode in hybrid.modes:
            at = whole_point(hybrid, mode)
            blocks = (block.full() for block in model.jacobians(at[:n], at[n:])[2:])
            slope = np.column_stack([*blocks])
            y = model.f(at[:n], at[n:])[1].full().ravel()
            found.append((slope, y - slope @ at))
        return found

    @cached_property
    def _step_covariance(self) -> np.ndarray:
        model = self.sampled.hybrid.model
        sizes = zip(model.states, model.scale, strict=True)
        relative = [self.process_noise.get(name, 0.0) / size for name, size in sizes]
        return np.diag(np.square(relative)) * self.sample_time_s

    @cached_property
    def _noise(self) -> np.ndarray:
        return np.array([self.measurement_noise[name] for name in self.plant.measured])


def standard_bank(plant: Plant) -> HybridModel:
    """The plant's standard modes under its own commands; where it has none, one at its start.

    Those of the gearbox have the valves' flows as inputs, which no computer knows: those with the
    commands take their place, and those in which contacts hold the piston.
    """
    if plant.name == "gearbox":
        return resting_modes(plant)
    known = STANDARD_MODES.get(plant.name)
    return known(plant) if known else hybrid_modes(plant, {})

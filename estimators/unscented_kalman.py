"""The unscented Kalman filter: the plant's own answer to points spread by the covariance.

Points and weights are Merwe's, by filterpy; they are drawn anew before the correction.  All points
go through the plant in one call.  The square root of a covariance comes from its eigenvalues, so
that a state without noise does no harm, and every covariance is made symmetric.

A bristle follows the velocity of each point, and is neither spread nor corrected: see
:class:`workbench.plant_filter.PlantFilter`, whose scaled states and noise are these too, half of it
before and half after the step.  Nor is the coil and armature of a switched valve, which follow the
command within milliseconds: points a share of a stroke apart would bounce on the stops.  Where a
point leaves the plant's range, so that its state is no number, the extended filter makes that step
and the note ``fallback`` is 1.

Source: Julier and Uhlmann 2004, "Unscented filtering and nonlinear estimation"; van der Merwe 2004
for points and weights; Särkkä 2013, "Bayesian filtering and smoothing", algorithm 5.14.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from estimators.extended_kalman import ExtendedKalman
from estimators.stochastic_plant import StochasticPlant
from workbench.contracts import Estimate
from workbench.effects.solenoid_valve import SolenoidValve

CENTRE, NORMAL = 2.0, 0.0  # beta for a normal distribution, kappa


@dataclass(frozen=True, kw_only=True)
class UnscentedKalman(StochasticPlant):
    """See the module.

    Attributes
    ----------
    spread
        Merwe's alpha: points lie alpha sqrt(n) standard deviations from the mean.
    """

    spread: float = 0.3

    def start(self, measurement: np.ndarray) -> Estimate:
        return self.extended.start(measurement)

    def update(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Estimate:
        ahead = self._predicted(*last.memory, command)
        if ahead is None:
            found = self.extended.update(last, command, measurement)
            return replace(found, notes={**found.notes, "fallback": 1.0})
        X, P, nis = self._corrected(*ahead, command, measurement)
        found = self.extended.estimate(X, P)
        received = float(np.isfinite(measurement).sum())
        notes = {**found.notes, "nis": nis, "received": received, "fallback": 0.0}
        return replace(found, notes=notes)

    def _predicted(
        self, X: np.ndarray, P: np.ndarray, command: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Scaled state and covariance one sample later; none where a point was lost."""
        from filterpy.kalman import unscented_transform

        half = 0.5 * self.extended.filter.step_covariance
        points = self._points(X, P + half)
        later = self._step(points.T, *self._inputs(command, len(points))).full().T
        if not np.isfinite(later).all():
            return None
        return unscented_transform(later, self._merwe.Wm, self._merwe.Wc, half)

    def _corrected(
        self, X: np.ndarray, P: np.ndarray, command: np.ndarray, measurement: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Scaled state and covariance with the measurement, and its normalised square."""
        from filterpy.kalman import unscented_transform

        seen = np.isfinite(measurement)
        if not seen.any():
            return X, 0.5 * (P + P.T), 0.0
        points, merwe, noise = self._points(X, P), self._merwe, self._noise[seen]
        outputs = self._outputs(points.T, *self._inputs(command, len(points))).full()[seen].T
        outputs = outputs / noise
        expected, S = unscented_transform(outputs, merwe.Wm, merwe.Wc, np.eye(seen.sum()))
        across = self._with_the_rest(points - X, P).T @ (merwe.Wc[:, None] * (outputs - expected))
        e = measurement[seen] / noise - expected
        K = np.zeros(across.shape)
        K[self._free] = np.linalg.solve(S, across[self._free].T).T
        # a gain that is held at 0 for the bristle is not the best one: the general form holds
        P = P - K @ across.T - across @ K.T + K @ S @ K.T
        return X + K @ e, 0.5 * (P + P.T), float(e @ np.linalg.solve(S, e))

    def _points(self, X: np.ndarray, P: np.ndarray) -> np.ndarray:
        """Points around X, one per row; what is not corrected stays at its mean."""
        free = self._free
        points = np.tile(X, (2 * len(free) + 1, 1))
        points[:, free] = self._merwe.sigma_points(X[free], P[np.ix_(free, free)])
        return points

    def _with_the_rest(self, off: np.ndarray, P: np.ndarray) -> np.ndarray:
        """Points less their mean, (m, n), what is not spread as far off as it goes with the others.

        Without it an output would seem to say nothing of a bristle that moves with the velocity,
        and what P holds of both would outgrow the variances.
        """
        free, rest = self._free, np.setdiff1d(np.arange(len(P)), self._free)
        if not len(rest):
            return off
        known = np.linalg.pinv(P[np.ix_(free, free)], hermitian=True)
        off[:, rest] = off[:, free] @ known @ P[np.ix_(free, rest)]
        return off

    def _inputs(self, command: np.ndarray, columns: int) -> list[np.ndarray]:
        _, d, p = self.plant.nominal
        return [np.tile(np.reshape(v, (-1, 1)), columns) for v in (command, d, p)]

    @cached_property
    def extended(self) -> ExtendedKalman:
        """The filter that starts, holds the noise, and takes over where a point is lost."""
        return ExtendedKalman(**self.assumed)

    @cached_property
    def _free(self) -> np.ndarray:
        """Rows that are spread: what is corrected, but for what a switched valve's coil moves."""
        valves = tuple(f"{e.name}." for e in self.plant.effects if isinstance(e, SolenoidValve))
        names, rows = self.plant.model.states, np.flatnonzero(self.extended.filter.corrected)
        return np.array([k for k in rows if not (k < len(names) and names[k].startswith(valves))])

    @cached_property
    def _noise(self) -> np.ndarray:
        return np.array([self.measurement_noise[name] for name in self.plant.measured])

    @cached_property
    def _merwe(self) -> Any:
        """The points of filterpy for the states that are spread."""
        from filterpy.kalman import MerweScaledSigmaPoints

        return MerweScaledSigmaPoints(
            len(self._free), self.spread, CENTRE, NORMAL, sqrt_method=_upper_root
        )

    @cached_property
    def _step(self) -> ca.Function:
        """(X, u, d, p), a column per point -> X one sample later."""
        found = self.extended.filter
        n, S = len(self.plant.scale), found.scale
        symbols = self.plant.model.symbols[1:]
        X = ca.MX.sym("X", len(S))
        u, d, p = (ca.MX.sym(k, s.numel()) for k, s in zip("udp", symbols, strict=True))
        x, w = S[:n] * X[:n], S[n:] * X[n:, 0]
        later = ca.vertcat(found.step(x, u, d, ca.vertcat(p, w)) / S[:n], X[n:, 0])
        return ca.Function("points", [X, u, d, p], [later]).map(2 * len(self._free) + 1)

    @cached_property
    def _outputs(self) -> ca.Function:
        """(X, u, d, p), a column per point -> outputs."""
        n, found, symbols = len(self.plant.scale), self.extended.filter, self.plant.model.symbols
        X = ca.MX.sym("X", len(found.scale))
        u, d, p = (ca.MX.sym(k, s.numel()) for k, s in zip("udp", symbols[1:], strict=True))
        real = found.scale * X
        y, _ = found.outputs(real[:n], real[n:, 0], u, d, p)
        return ca.Function("seen", [X, u, d, p], [y]).map(2 * len(self._free) + 1)


def _upper_root(P: np.ndarray) -> np.ndarray:
    """A square root U with U' U = P, as filterpy takes it; eigenvalues below zero count as zero."""
    values, vectors = np.linalg.eigh(0.5 * (P + P.T))
    return (vectors * np.sqrt(np.maximum(values, 0.0))).T

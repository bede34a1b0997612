"""Moving-horizon estimation: Gauss-Newton on the last samples, arrival cost from a Kalman filter.

    min over x_0 .. x_N   |x_0 - prior|^2_P  +  sum |x_k+1 - step(x_k, u_k)|^2_Q
                          + sum |y_k - h(x_k)|^2_R

One Gauss-Newton step on this problem, linearised along a trajectory, is one Kalman filter and
smoother pass over the window (Bell 1994), which exploits its structure and needs no solver.  The
trajectory of the last sample, shifted, is where the next one is linearised, so one pass per sample
is enough; more can be asked for.  What leaves the window enters the prior.

A bristle follows the trajectory's velocity through the plant itself and is neither corrected nor
smoothed: moved along a tangent it would bend further than it can.

On a linear plant every pass is exact and the estimate is that of the Kalman filter.

Source: Bell 1994, "The iterated Kalman smoother as a Gauss-Newton method"; Rao, Rawlings and Mayne
2003, "Constrained state estimation for nonlinear discrete-time systems", for the arrival cost.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import casadi as ca
import numpy as np

from estimators.extended_kalman import ExtendedKalman
from workbench.contracts import Estimate
from workbench.filtering import smoothed
from workbench.plant import Plant


@dataclass(frozen=True)
class Node:
    """One sample of the window, scaled as in :class:`PlantFilter`.

    point         where the plant is linearised, shape (n_X,)
    command       held from this sample to the next, shape (n_u,); not yet known at the newest
    measurement   shape (n_y,), NaN where missing
    """

    point: np.ndarray
    command: np.ndarray
    measurement: np.ndarray


@dataclass(frozen=True)
class Window:
    """The samples of the horizon and what was known before the first of them."""

    prior: np.ndarray
    covariance: np.ndarray
    nodes: tuple[Node, ...]


@dataclass(frozen=True)
class Pass:
    """One filter pass over a window, one entry per node: see :func:`workbench.filtering.smoothed`.

    ``prior`` and ``covariance`` are what the first node hands on to the second.
    """

    X: np.ndarray
    P: np.ndarray
    F: np.ndarray
    said: np.ndarray
    weights: np.ndarray
    left: np.ndarray
    prior: np.ndarray
    covariance: np.ndarray


@dataclass(frozen=True, kw_only=True)
class MovingHorizon:
    """An estimator that looks back over ``horizon`` samples; see the module.

    Attributes
    ----------
    measurement_noise, process_noise, unknown_inputs
        As in :class:`ExtendedKalman`.
    passes
        Gauss-Newton steps per sample.
    """

    plant: Plant
    sample_time_s: float
    measurement_noise: Mapping[str, float]
    process_noise: Mapping[str, float]
    unknown_inputs: Mapping[str, float] = field(default_factory=dict)
    horizon: int = 4
    passes: int = 1

    def start(self, measurement: np.ndarray) -> Estimate:
        begun = self.kalman.start(measurement)
        nothing = np.full(len(self.plant.measured), np.nan)
        node = Node(begun.memory[0], self.plant.nominal[0], nothing)
        return replace(begun, memory=Window(*begun.memory, (node,)))

    def update(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Estimate:
        window = self._moved(last, command, measurement)
        done = self._pass(window)
        for _ in range(self.passes - 1):
            window = self._relinearised(window, done)
            done = self._pass(window)
        if not (np.isfinite(done.X).all() and np.isfinite(done.P).all()):
            return self._fallback(last, command, measurement)
        window = self._relinearised(window, done)
        if len(window.nodes) > self.horizon:
            window = Window(done.prior, done.covariance, window.nodes[1:])
        found = self.kalman.estimate(done.X[-1], done.P[-1])
        return replace(found, memory=window, notes={**found.notes, "fallback": 0.0})

    @cached_property
    def kalman(self) -> ExtendedKalman:
        """The filter that starts the window, and that takes over where a pass fails."""
        return ExtendedKalman(
            plant=self.plant,
            sample_time_s=self.sample_time_s,
            measurement_noise=self.measurement_noise,
            process_noise=self.process_noise,
            unknown_inputs=self.unknown_inputs,
        )

    def _moved(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Window:
        """The window with one more sample, linearised where the last estimate leads."""
        window, found, (_, d, p) = last.memory, self.kalman.filter, self.plant.nominal
        newest = replace(window.nodes[-1], command=command)
        ahead, _, _ = found.predict(newest.point, window.covariance, command, d, p)
        node = Node(ahead.full().ravel(), command, measurement)
        return replace(window, nodes=(*window.nodes[:-1], newest, node))

    def _pass(self, window: Window) -> Pass:
        """Filter from node to node; the newest is corrected only, its F is not read."""
        (_, d, p), X, P = self.plant.nominal, window.prior, window.covariance
        found, rows, handed = self.kalman.filter, [], []
        for i, node in enumerate(window.nodes):
            received = np.isfinite(node.measurement)
            y = np.where(received, node.measurement, 0.0)
            X, P, *said = self._correct(X, P, node.point, node.command, d, p, y, received)
            if i == len(window.nodes) - 1:
                F = P
                rows.append((X, P, F, *said))
                break
            ahead, P_next, F = found.predict(node.point, P, node.command, d, p)
            rows.append((X, P, F, *said))
            X, P = ahead + found.corrected * (F @ (X - node.point)), P_next
            handed.append((X.full().ravel(), P.full()))
        columns = (np.array([m.full() for m in column]) for column in zip(*rows, strict=True))
        X, P, F, said, weights, left = columns
        return Pass(X[..., 0], P, F, said[..., 0], weights, left, *handed[0])

    def _relinearised(self, window: Window, done: Pass) -> Window:
        """The window linearised along the smoothed trajectory; bristles follow the filter."""
        path, _ = smoothed(done.X, done.P, done.F, done.said, done.weights, done.left)
        path = np.where(self.kalman.filter.corrected, path, done.X)
        nodes = zip(window.nodes, path, strict=True)
        return replace(window, nodes=tuple(replace(node, point=at) for node, at in nodes))

    def _fallback(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Estimate:
        """A Kalman step from the last estimate, and a window that starts anew."""
        scale = self.kalman.filter.scale
        n, X = len(self.plant.scale), last.memory.nodes[-1].point.copy()
        X[:n] = last.state / scale[:n]
        P = self.kalman.filter.start_covariance.copy()
        P[:n, :n] = last.covariance / np.outer(scale[:n], scale[:n])
        found = self.kalman.update(replace(last, memory=(X, P)), command, measurement)
        nothing = np.full(len(measurement), np.nan)
        node = Node(found.memory[0], command, nothing)
        window = Window(*found.memory, (node,))
        return replace(found, memory=window, notes={**found.notes, "fallback": 1.0})

    @cached_property
    def _correct(self) -> ca.Function:
        """(X, P, point, u, d, p, y, received) -> (X, P, i, J, L), linearised at ``point``.

        With delta = X - point and L = I - K H, the filter's own correction at the point gives
        X = corrected + L delta; i and J as in :attr:`PlantFilter.correct`.
        """
        found, model = self.kalman.filter, self.plant.model
        n = len(found.scale)
        X, P, point = ca.MX.sym("X", n), ca.MX.sym("P", n, n), ca.MX.sym("point", n)
        u, d, p = (ca.MX.sym(k, s.numel()) for k, s in zip("udp", model.symbols[1:], strict=True))
        y, received = (ca.MX.sym(k, len(model.measured)) for k in ("y", "received"))
        delta = X - point
        at, P_now, *_, said, weights, left = found.correct(point, P, u, d, p, y, received)
        results = [at + left @ delta, P_now, said - weights @ delta, weights, left]
        return ca.Function("correct_at", [X, P, point, u, d, p, y, received], results)

"""Linear-quadratic gains of one sampled mode: Bryson's weights by signal name, integral action.

    min   sum |x_i / tolerable_i|^2 + (u / tolerable)^2 + (integral / (tolerable position T_i))^2

on x[k+1] = F x + G u about the mode's point; what the mode drifts is met by the target of its
states and the opening that go with the wanted motion (:mod:`controllers.motion`).

Source: A. E. Bryson and Y.-C. Ho, "Applied Optimal Control", 1975 (weights).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_discrete_are

from controllers.margins import Law, integral_of
from linearize.discrete import sampled
from linearize.modes import Mode
from workbench.errors import InputError, Message, listed, nearest


class NoGainError(np.linalg.LinAlgError):
    """Weights that lead to no gains, though the mode can be steered."""


@dataclass(frozen=True)
class Gain:
    """Feedback of (position, velocity, pressure a, pressure b) and of the integral of the error.

    feedback      K in V per unit of state, shape (4,)
    integral      K_i in V/(m s)
    poles         of the closed loop with integral, on the plane of s, 1/s, shape (5,); of one at
                  a negative z, which has no partner, that with the positive imaginary part
    """

    feedback: np.ndarray
    integral: float
    poles: np.ndarray

    def law(self, sample_time_s: float) -> Law:
        """Its memory is the integral of the error."""
        return integral_of(self.feedback, self.integral, sample_time_s)


def lq_gain(
    mode: Mode, tolerable: Mapping[str, float], integral_time_s: float, sample_time_s: float
) -> Gain:
    """The gain of one mode, its first state being the position.

    Parameters
    ----------
    tolerable
        Deviation by name of a state or the command, each worth a cost of one; a state that is not
        named costs nothing, the position and the command must be.

    Raises
    ------
    InputError
        If a name is none of the mode's, or the position or the command has no weight.
    NoGainError
        If the regulator of these weights cannot be computed.
    """
    _require_weights(mode, tolerable)
    position = mode.state_names[0]
    costs = [tolerable[name] ** -2.0 if name in tolerable else 0.0 for name in mode.state_names]
    Q = np.diag([*costs, (tolerable[position] * integral_time_s) ** -2.0])
    R = np.array([[tolerable[mode.command_names[0]] ** -2.0]])
    F, G = with_integral(mode, sample_time_s)
    try:
        with np.errstate(invalid="raise"):  # what scipy would only warn of ends in zero gains
            K = dlqr(F, G, Q, R, np.array([*mode.scale, mode.scale[0]]))
    except (np.linalg.LinAlgError, FloatingPointError) as error:
        what = f"mode {mode.name!r}: no gains can be computed from these weights"
        raise NoGainError(what) from error
    return gain_of(mode, K[0], sample_time_s)


def with_integral(mode: Mode, sample_time_s: float) -> tuple[np.ndarray, np.ndarray]:
    """F and G of a sampled mode, extended by the integral of its first state up to a sample."""
    small, n = sampled(mode, sample_time_s), len(mode.state_names)
    F, G = np.eye(n + 1), np.zeros((n + 1, 1))
    F[:n, :n], F[n, 0], G[:n] = small.F, sample_time_s, small.G
    return F, G


def gain_of(mode: Mode, K: np.ndarray, sample_time_s: float) -> Gain:
    """A state feedback K of (state, integral), shape (n + 1,), with the poles of its loop.

    The controllers integrate the error of a sample before they use the integral, which is worth
    K_i T more of the first gain than the design has: the poles are those with it.
    """
    F, G = with_integral(mode, sample_time_s)
    as_run = K + K[-1] * sample_time_s * (np.arange(len(K)) == 0)
    poles = np.log(np.linalg.eigvals(F - G @ as_run[None, :]).astype(complex)) / sample_time_s
    return Gain(K[:-1], float(K[-1]), poles)


def dlqr(
    F: np.ndarray, G: np.ndarray, Q: np.ndarray, R: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """K of u = -K x that minimises the sum of x'Qx + u'Ru, shape (n_u, n_x); solved scaled."""
    F, G = F * scale / scale[:, None], G / scale[:, None]
    Q = Q * np.outer(scale, scale)
    X = solve_discrete_are(F, G, Q, R)
    return np.linalg.solve(R + G.T @ X @ G, G.T @ X @ F) / scale


def _require_weights(mode: Mode, tolerable: Mapping[str, float]) -> None:
    known = (*mode.state_names, *mode.command_names)
    wrong = [
        Message("no such signal to weigh", name, listed(known), nearest(name, known))
        for name in tolerable
        if name not in known
    ]
    wrong += [
        Message("has no tolerable deviation", name, "one above 0")
        for name in (mode.state_names[0], mode.command_names[0])
        if name not in tolerable
    ]
    if wrong:
        raise InputError(*wrong)

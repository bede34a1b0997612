"""The condensed quadratic program of linear MPC on one mode; see :mod:`controllers.linear_mpc`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.linalg import solve_discrete_are

from controllers.margins import Law
from controllers.mpc_limits import SLACK_UNIT, SLACKS, Limits, soft_rows
from controllers.mpc_spec import MpcSpec
from controllers.positioning import STATES
from controllers.program_solvers import Answer, Daqp, Solver, Start, Workspace
from controllers.stacked import pushed_mode, stacked
from linearize.discrete import sampled
from linearize.modes import Mode

PRICED = np.array([10.0, 1.0, 1.0, 1.0, 0.1])  # 10 mm, ..., 0.1 V: they have the same price
BALANCING = np.array([0.0, 0.0, -0.5, 0.5])  # pressures that balance a push, per push and area


class Asked(NamedTuple):
    """What a sample asks of a program of N samples.

    x           state now, shape (4,)
    force_n     on the slide, all along
    places_m    where the slide should be, shape (N,)
    others      what velocity and pressures should be, shape (3,)
    steady_v    opening that costs nothing
    last_v      opening of the sample before
    """

    x: np.ndarray
    force_n: float
    places_m: np.ndarray
    others: np.ndarray
    steady_v: float
    last_v: float

    @property
    def targets(self) -> np.ndarray:
        """What the stacked states should be, shape (4 N,)."""
        stacked = np.empty((len(self.places_m), len(STATES)))
        stacked[:, 0], stacked[:, 1:] = self.places_m, self.others
        return stacked.ravel()

    @property
    def row(self) -> np.ndarray:
        """All of it in this order, and behind the force a one for the drift, shape (N + 11,)."""
        n = len(self.places_m)
        row = np.empty(n + 11)
        row[:4], row[4], row[5] = self.x, self.force_n, 1.0
        row[6 : 6 + n], row[6 + n : -2] = self.places_m, self.others
        row[-2], row[-1] = self.steady_v, self.last_v
        return row


@dataclass(frozen=True)
class Program:
    """The quadratic program of one mode: min z'Hz/2 + g'z, lower <= rows z <= upper.

    z holds the N openings, one slack per state and one for the rate.  Stacked predictions are
    X = free x + forced U + drift + pushed f, with X of shape (4 N,) and a force f on the slide.

    Its hessian H, shape (n_z, n_z), and its rows, shape (n_c, n_z), follow from the rest.

    free, forced        shapes (4 N, 4) and (4 N, N)
    drift, pushed       shapes (4 N,)
    Q                   cost of the stacked states, shape (4 N, 4 N)
    R, S                cost of an opening and of its change
    limits              what openings and states must keep
    slack_weight        cost of a violation that grows as its square
    slack_price         cost of a violation that grows in proportion
    solver              what solves it at its limits
    """

    free: np.ndarray
    forced: np.ndarray
    drift: np.ndarray
    pushed: np.ndarray
    Q: np.ndarray
    R: float
    S: float
    limits: Limits
    slack_weight: float
    slack_price: float
    solver: Solver = Daqp()

    @property
    def horizon(self) -> int:
        return self.forced.shape[1]

    @cached_property
    def weighed(self) -> np.ndarray:
        """The costs of the forced states, Q forced, shape (4 N, N)."""
        N, n = self.horizon, len(STATES)
        ahead, stage, to_go = self.forced.reshape(N, n, N), self.Q[:n, :n], self.Q[-n:, -n:]
        return np.concatenate([stage @ ahead[:-1], (to_go @ ahead[-1])[None]]).reshape(n * N, N)

    @cached_property
    def hessian(self) -> np.ndarray:
        """Second derivatives of the cost of openings and slacks, shape (n_z, n_z)."""
        N, moves = self.horizon, moves_of(self.horizon)
        H = np.diag(np.full(N + SLACKS, 2.0 * self.slack_weight))
        pull = self.forced.T @ self.weighed
        H[:N, :N] = 2.0 * (pull + self.R * np.eye(N) + self.S * moves.T @ moves)
        return H

    @cached_property
    def rows(self) -> np.ndarray:
        """What is limited: openings, what is soft below and above, slacks; shape (n_c, n_z)."""
        N, n = self.horizon, len(STATES)
        rows = np.zeros((N + 2 * SLACKS * N + SLACKS, N + SLACKS))
        rows[:N, :N], rows[-SLACKS:, N:] = np.eye(N), np.eye(SLACKS)
        for where, sign in zip(soft_rows(N), (1.0, -1.0), strict=True):
            soft = rows[where]
            soft[: n * N, :N] = self.forced / np.tile(SLACK_UNIT, N)[:, None]
            soft[: n * N, N:-1] = np.tile(sign * np.eye(n), (N, 1))
            soft[n * N :, :N], soft[n * N :, -1] = moves_of(N), sign
        return rows

    def unforced(self, x: np.ndarray, force_n: float) -> np.ndarray:
        """Stacked states under zero openings, shape (4 N,)."""
        causes = np.ones(len(x) + 2)
        causes[: len(x)], causes[-2] = x, force_n
        return self.reply @ causes

    @cached_property
    def reply(self) -> np.ndarray:
        """Of the stacked states to state, force and drift, shape (4 N, 6)."""
        return np.column_stack([self.free, self.pushed, self.drift])

    def gradient(
        self, unforced: np.ndarray, targets: np.ndarray, steady_v: float, last_v: float
    ) -> np.ndarray:
        """G for stacked targets (4 N,), the steady opening and the last one."""
        g = self.priced.copy()
        pull = g[: self.horizon]
        np.matmul(unforced - targets, self.weighed, out=pull)
        pull -= self.R * steady_v
        pull[0] -= self.S * last_v
        pull *= 2.0
        return g

    @cached_property
    def priced(self) -> np.ndarray:
        """The gradient of the slacks alone, shape (n_z,)."""
        return np.concatenate([np.zeros(self.horizon), self.slack_price / PRICED])

    def unlimited(self, g: np.ndarray) -> np.ndarray:
        """The openings that are best without limits, shape (N,); no slack is needed for them."""
        return -(self.inverse @ g[: self.horizon])

    def keeps(self, openings: np.ndarray, unforced: np.ndarray, last_v: float) -> bool:
        """Whether openings, shape (N,), keep all limits; not finite, they do not."""
        n = self.horizon
        at = np.empty((2 + len(STATES)) * n)
        at[:n], moves = openings, at[-n:]
        np.matmul(self.forced, openings, out=at[n:-n])
        at[n:-n] += unforced
        moves[0] = openings[0] - last_v
        np.subtract(openings[1:], openings[:-1], out=moves[1:])
        return self.limits.kept(at)

    def without_limits(self, asked: Asked) -> np.ndarray:
        """The best openings, the states that they lead to, and their changes, shape (6 N,).

        The same as :meth:`unlimited` finds, in one product.
        """
        return self.answer @ asked.row

    @cached_property
    def answer(self) -> np.ndarray:
        """Of what :meth:`without_limits` gives to a row of :class:`Asked`, (6 N, N + 11)."""
        N, n, gain = self.horizon, len(STATES), -2.0 * self.inverse
        pull = gain @ self.weighed.T  # of the openings to stacked states off their targets
        by_target = pull.reshape(N, N, n)
        towards = [-by_target[:, :, 0], -by_target[:, :, 1:].sum(axis=1)]
        priced = [-self.R * gain.sum(axis=1), -self.S * gain[:, 0]]
        openings = np.column_stack([pull @ self.reply, *towards, *priced])
        states, moves = self.forced @ openings, moves_of(N) @ openings
        states[:, : self.reply.shape[1]] += self.reply
        moves[0, -1] -= 1.0
        return np.concatenate([openings, states, moves])

    @cached_property
    def inverse(self) -> np.ndarray:
        """Inverse of H on the openings, for the optimum without limits, shape (N, N)."""
        return np.linalg.inv(self.hessian[: self.horizon, : self.horizon])

    def law(self, force_n_m_s: float, area_m2: float, sample_time_s: float) -> Law:
        """The first opening without limits; its memory is the integral and the last opening.

        The integral grows into a force: it pushes the prediction and shifts the target pressures.
        """
        first, n = self.answer[0], len(STATES)
        shift = BALANCING[1:] / area_m2
        integral = force_n_m_s * (first[n] + first[-2 - len(shift) : -2] @ shift)
        error = sample_time_s * np.eye(n)[0]
        C, D = np.array([integral, first[-1]]), first[:n] + integral * error
        return Law(np.array([[1.0, 0.0], C]), np.array([error, D]), C, D)

    def solved(
        self, g: np.ndarray, low: np.ndarray, high: np.ndarray, start: Start | None
    ) -> Answer | None:
        """What the solver finds, from a start where there is one."""
        return self.solver.solved(self, g, low, high, start)

    @cached_property
    def order(self) -> np.ndarray:
        """Rows as DAQP reads them: those that bound one variable each, as in z, then the rest."""
        every = np.arange(len(self.rows))
        return np.concatenate(
            [every[: self.horizon], every[-SLACKS:], every[self.horizon : -SLACKS]]
        )

    @cached_property
    def workspace(self) -> Workspace:
        """DAQP's, which bounds of single variables do not enter as rows."""
        general = self.rows[self.order[self.horizon + SLACKS :]]
        return Workspace(self.hessian, np.ascontiguousarray(general))

    def prepared(self) -> Program:
        """The same program with its factors at hand, so that the first sample need not wait."""
        _ = self.workspace, self.inverse, self.answer, self.priced
        _ = self.limits.sides, self.limits.within
        return self


def program_of(
    mode: Mode,
    spec: MpcSpec,
    centre_v: float,
    area_m2: float,
    limits: np.ndarray,
    openings: tuple[float, float],
) -> Program:
    """The condensed program of a mode; ``limits`` of the states of a sample, shape (2, 4)."""
    small, N = sampled(mode, spec.sample_time_s), spec.horizon
    tolerable = np.array([spec.position_m, spec.velocity_m_s, spec.pressure_pa, spec.pressure_pa])
    Q, R, S = np.diag(tolerable**-2.0), spec.opening_v**-2.0, spec.move_v**-2.0
    scale = mode.scale
    to_go = solve_discrete_are(
        small.F * scale / scale[:, None],
        small.G / scale[:, None],
        Q * np.outer(scale, scale),
        np.array([[R]]),
    ) / np.outer(scale, scale)
    offset = small.offset + small.G[:, 0] * centre_v
    free, forced, drift = stacked(small.F, small.G, offset, N)
    push = sampled(pushed_mode(mode, area_m2), spec.sample_time_s).offset - small.offset
    _, _, pushed = stacked(small.F, small.G, push, N)
    stages = sp.block_diag([Q] * (N - 1) + [to_go]).toarray()
    limited = Limits(np.tile(limits, N), openings, spec.rate_v_s * spec.sample_time_s)
    prices = spec.slack_weight, spec.slack_price
    return Program(free, forced, drift, pushed, stages, R, S, limited, *prices)


@cache
def moves_of(N: int) -> np.ndarray:
    """Changes of N openings, the first from nothing, shape (N, N)."""
    return np.eye(N) - np.eye(N, k=-1)

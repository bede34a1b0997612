"""The condensed quadratic program of linear MPC on one mode; see :mod:`controllers.linear_mpc`."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache, cached_property

import numpy as np
import scipy.sparse as sp
from scipy.linalg import solve_discrete_are

from controllers.margins import Law
from controllers.positioning import STATES, PositioningSpec
from controllers.program_solvers import Answer, Daqp, Solver, Start
from controllers.spec import ranged
from controllers.stacked import pushed_mode, stacked
from linearize.axes import stroke_m
from linearize.discrete import sampled
from linearize.modes import Mode
from linearize.standard import SUPPLY
from workbench.errors import InputError, Message, listed
from workbench.plant import Plant

SLACK_UNIT = np.array([1e-3, 0.1, 1e4, 1e4])  # m, m/s, Pa, Pa: violations that cost alike
PRICED = np.array([10.0, 1.0, 1.0, 1.0, 0.1])  # 10 mm, ..., 0.1 V: they have the same price
BALANCING = np.array([0.0, 0.0, -0.5, 0.5])  # pressures that balance a push, per push and area
SLACKS = len(STATES) + 1  # one per state, and one for the rate of the opening, in V per sample
LONGEST = 500  # samples ahead; the program is dense, and grows with the square


@dataclass(frozen=True, kw_only=True)
class MpcSpec:
    """Tolerable deviations, each worth a cost of one, horizon, limits and clock.

    Attributes
    ----------
    move_v
        Tolerable change of the opening from sample to sample.
    force_n_m_s
        Force by which the target pressures shift per integral of the position error.
    margin_m
        The position stays this far from the end stops.
    lowest_m, below_end_m
        Soft limits of the position where they are tighter, the upper one as its distance from the
        end of the stroke.
    lowest_pa, below_supply_pa
        Soft limits of the pressures, the upper one as its distance from the supply pressure.
    fastest_m_s, rate_v_s
        Soft limits of the speed, and of how fast the opening changes.
    slack_weight
        Cost of violating a limit by 1 mm, 0.1 m/s, 0.1 bar or 1 V per sample; grows as the square.
    slack_price
        Cost of violating a limit by 10 mm, 0.1 m/s, 0.1 bar or 0.1 V per sample; grows in
        proportion, so that a limit is kept wherever keeping it costs less.
    """

    sample_time_s: float = 2e-3
    horizon: int = ranged(20, least=1, most=LONGEST)
    position_m: float = 1e-3
    velocity_m_s: float = 0.1
    pressure_pa: float = 1e6
    opening_v: float = 0.3
    move_v: float = 3.0
    force_n_m_s: float = ranged(5e4)
    margin_m: float = ranged(2e-3)
    lowest_m: float = ranged(0.0)
    below_end_m: float = ranged(0.0)
    lowest_pa: float = 1.2e5
    below_supply_pa: float = ranged(1e4)
    fastest_m_s: float = 2.0
    rate_v_s: float = 2.5e3
    slack_weight: float = 1e3
    slack_price: float = ranged(1e4)
    positioning: PositioningSpec = field(default_factory=PositioningSpec)


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
    state_limits        lower and upper of the states over the horizon, shape (2, 4 N)
    openings            smallest and largest opening
    move_v              largest change of the opening from sample to sample, soft
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
    state_limits: np.ndarray
    openings: tuple[float, float]
    move_v: float
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
        return self.free @ x + self.drift + self.pushed * force_n

    def gradient(
        self, unforced: np.ndarray, targets: np.ndarray, steady_v: float, last_v: float
    ) -> np.ndarray:
        """G for stacked targets (4 N,), the steady opening and the last one."""
        pull = (unforced - targets) @ self.weighed
        pull -= self.R * steady_v
        pull[0] -= self.S * last_v
        return np.concatenate([2.0 * pull, self.slack_price / PRICED])

    def bounds(self, unforced: np.ndarray, last_v: float) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper side of the rows: openings, what is soft twice, slacks."""
        n, (lower, upper) = self.horizon, (side.copy() for side in self.sides)
        at = (unforced.reshape(n, -1) / SLACK_UNIT).ravel()
        soft = len(at) + n
        lower[n : n + len(at)] -= at
        upper[n + soft : n + soft + len(at)] -= at
        lower[n + len(at)] += last_v
        upper[n + soft + len(at)] += last_v
        return lower, upper

    @cached_property
    def sides(self) -> tuple[np.ndarray, np.ndarray]:
        """What :meth:`bounds` gives for states and a last opening of zero."""
        n = self.horizon
        low, high = self.state_limits / np.tile(SLACK_UNIT, n)
        moved, slack = np.full(n, self.move_v), np.zeros(SLACKS)
        none = np.full(len(low) + n, np.inf)
        first, last = (np.full(n, side) for side in self.openings)
        lower = [first, low, -moved, -none, slack]
        upper = [last, none, high, moved, slack + np.inf]
        return np.concatenate(lower), np.concatenate(upper)

    def unlimited(self, g: np.ndarray) -> np.ndarray:
        """The openings that are best without limits, shape (N,); no slack is needed for them."""
        return -(self.inverse @ g[: self.horizon])

    def keeps(self, openings: np.ndarray, unforced: np.ndarray, last_v: float) -> bool:
        """Whether openings, shape (N,), keep all limits; not finite, they do not."""
        (smallest_v, largest_v), (low, high) = self.openings, self.state_limits
        moves = openings.copy()
        moves[0] -= last_v
        moves[1:] -= openings[:-1]
        if not np.abs(moves).max() <= self.move_v:
            return False
        if not (openings.min() >= smallest_v and openings.max() <= largest_v):
            return False
        ahead = unforced + self.forced @ openings
        return bool((ahead >= low).all() and (ahead <= high).all())

    @cached_property
    def inverse(self) -> np.ndarray:
        """Inverse of H on the openings, for the optimum without limits, shape (N, N)."""
        return np.linalg.inv(self.hessian[: self.horizon, : self.horizon])

    def law(self, force_n_m_s: float, area_m2: float, sample_time_s: float) -> Law:
        """The first opening without limits; its memory is the integral and the last opening.

        The integral grows into a force: it pushes the prediction and shifts the target pressures.
        """
        pull = -2.0 * self.inverse[0] @ self.weighed.T
        shift = np.tile(BALANCING, self.horizon) / area_m2
        integral = force_n_m_s * pull @ (self.pushed - shift)
        error = sample_time_s * np.eye(len(STATES))[0]
        C = np.array([integral, 2.0 * self.S * self.inverse[0, 0]])
        D = pull @ self.free + integral * error
        return Law(np.array([[1.0, 0.0], C]), np.array([error, D]), C, D)

    def solved(
        self, g: np.ndarray, low: np.ndarray, high: np.ndarray, start: Start | None
    ) -> Answer | None:
        """What the solver finds, from a start where there is one."""
        return self.solver.solved(self, g, low, high, start)

    @cached_property
    def order(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows that bound one variable each, in the order of z, and all others."""
        every = np.arange(len(self.rows))
        bounds = np.concatenate([every[: self.horizon], every[-SLACKS:]])
        return bounds, every[self.horizon : -SLACKS]

    @cached_property
    def general(self) -> np.ndarray:
        """The rows that are no bounds of a variable, as DAQP reads them."""
        return np.ascontiguousarray(self.rows[self.order[1]])

    def prepared(self) -> Program:
        """The same program with its factors at hand, so that the first sample need not wait."""
        _ = self.general, self.inverse, self.sides
        return self


def program_of(
    mode: Mode,
    spec: MpcSpec,
    centre_v: float,
    area_m2: float,
    limits: np.ndarray,
    openings: tuple[float, float],
) -> Program:
    """The condensed program of a mode; ``limits`` as :func:`limits_of` gives them."""
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
    limited = np.tile(limits, N), openings, spec.rate_v_s * spec.sample_time_s
    prices = spec.slack_weight, spec.slack_price
    return Program(free, forced, drift, pushed, stages, R, S, *limited, *prices)


def soft_rows(N: int) -> tuple[slice, slice]:
    """Rows of what is soft below and above: the states of all samples, then the N moves."""
    below, above, end = (N * (1 + side * SLACKS) for side in range(3))
    return slice(below, above), slice(above, end)


@cache
def moves_of(N: int) -> np.ndarray:
    """Changes of N openings, the first from nothing, shape (N, N)."""
    return np.eye(N) - np.eye(N, k=-1)


def limits_of(plant: Plant, spec: MpcSpec, method: str = "mpc") -> np.ndarray:
    """Lowest and highest position, velocity and pressures, shape (2, 4).

    ``method`` is the controller whose numbers they are.

    Raises
    ------
    InputError
        If nothing is left between them.
    """
    highest_pa = float(plant.values[SUPPLY]) - spec.below_supply_pa
    lowest_m, below_m = (max(spec.margin_m, each) for each in (spec.lowest_m, spec.below_end_m))
    low = [lowest_m, -spec.fastest_m_s, spec.lowest_pa, spec.lowest_pa]
    high = [stroke_m(plant) - below_m, spec.fastest_m_s, highest_pa, highest_pa]
    if not np.less(low, high).all():
        names = "margin_m", "lowest_pa", "below_supply_pa", "lowest_m", "below_end_m"
        what = listed([f"{name} {getattr(spec, name):g}" for name in names])
        expected = "less than the stroke and the supply pressure between them"
        raise InputError(Message(f"{what} leave no room on {plant.name}", method, expected))
    return np.array([low, high])

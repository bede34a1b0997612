"""An extended Kalman filter on a plant, one sample as one CasADi function.

Chosen state rates may carry an unknown input, chosen parameters may wander, both as random walks:

    dx/dt = f(x, u, d, p + S w) + E w + process noise,     dw/dt = noise of the given intensity
    y = h(x, u, d, p + S w) + measurement noise

The transition matrix is not differentiated through the integrator.  It is the stability function
of Radau IIA of order 3 at a quarter of the step, squared twice: L-stable, so that a bristle at
-2e4 1/s is damped, and good to 1e-6 where the drive moves (40 rad/s at 5 ms).

All matrices are in scaled states, X = (x / plant.scale, w / intensity).

Source: Särkkä 2013, "Bayesian filtering and smoothing", algorithm 5.4; Hairer and Wanner,
"Solving ordinary differential equations II", IV.3, for the stability function.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import inf

import casadi as ca
import numpy as np

from workbench.compiled import compiled
from workbench.effects.bristle_friction import BristleFriction
from workbench.plant import Plant, require
from workbench.rosenbrock import controlled_step

SQUARINGS = 2
VANISHING = 1e-100  # its square underflows in the solver's reflections, which divide by it


def transition(A: ca.MX, step_s: float) -> ca.MX:
    """exp(A h) by ((I + z/3) (I - 2z/3 + z^2/6)^-1)^4 with z = A h / 4.

    Entries that have died away, such as those of a coil's current long after its release, are 0.
    """
    unit = ca.MX.eye(A.shape[0])
    z = A * (step_s / 2**SQUARINGS)
    z *= ca.fabs(z) > VANISHING
    F = ca.solve(unit - 2.0 / 3.0 * z + z @ z / 6.0, unit + z / 3.0)
    for _ in range(SQUARINGS):
        F = F @ F
    return F


@dataclass(frozen=True, kw_only=True)
class PlantFilter:
    """An extended Kalman filter on a plant, with random-walk inputs on chosen state rates.

    Attributes
    ----------
    sample_time_s, decimate
        Inputs are held for ``sample_time_s``; one measurement is used every ``decimate`` samples.
    measurement_noise
        Standard deviation by output; every output of the plant needs one.
    process_noise
        Standard deviation that a state gains per square root of a second; others gain none.
    unknown_inputs
        Standard deviation that an unknown rate of a state, or what is added to a parameter, gains
        per square root of a second.
    initial_deviation
        Standard deviation at the start by state, the plant's scale by default.
    considered
        States that no measurement corrects, though their uncertainty counts (Schmidt 1966).
    """

    plant: Plant
    sample_time_s: float
    measurement_noise: Mapping[str, float]
    process_noise: Mapping[str, float] = field(default_factory=dict)
    unknown_inputs: Mapping[str, float] = field(default_factory=dict)
    initial_deviation: Mapping[str, float] = field(default_factory=dict)
    decimate: int = 1
    considered: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        states, who = self.plant.model.states, f"states of {self.plant.name}"
        wandering = self.plant.model.parameters
        rates = [name for name in self.unknown_inputs if name not in wandering]
        for group in (self.process_noise, rates, self.initial_deviation, self.considered):
            require(group, states, who)
        missing = [n for n in self.plant.measured if self.measurement_noise.get(n, 0.0) <= 0.0]
        if missing:
            raise ValueError(f"{self.plant.name}: no measurement noise for {', '.join(missing)}")
        if min(self.unknown_inputs.values(), default=1.0) <= 0.0:
            raise ValueError("an unknown input needs an intensity above zero")

    @cached_property
    def scale(self) -> np.ndarray:
        """Unit of each entry of X, shape (n_x + n_w,)."""
        return np.array([*self.plant.scale, *self.unknown_inputs.values()])

    @cached_property
    def start_covariance(self) -> np.ndarray:
        """Covariance of X before the first measurement, shape (n_x + n_w, n_x + n_w)."""
        pairs = zip(self.plant.model.states, self.plant.scale, strict=True)
        return self._diagonal(
            [self.initial_deviation.get(name, size) / size for name, size in pairs]
        )

    @cached_property
    def step_covariance(self) -> np.ndarray:
        """Covariance that X gains in a step of the filter, shape (n_x + n_w, n_x + n_w)."""
        pairs = zip(self.plant.model.states, self.plant.scale, strict=True)
        gained = self._diagonal([self.process_noise.get(name, 0.0) / size for name, size in pairs])
        return gained * self.sample_time_s * self.decimate

    def _diagonal(self, of_states: list[float]) -> np.ndarray:
        """Variances from standard deviations of the scaled states; 1 for unknown inputs."""
        return np.diag(np.array([*of_states, *[1.0] * len(self.unknown_inputs)]) ** 2)

    @cached_property
    def predict(self) -> ca.Function:
        """(X, P, u, d, p) -> (X, P, F) one step later; u and d have one column per sample."""
        sizes = [self.predict_gaining.size_in(i) for i in range(5)]
        symbols = [ca.MX.sym(f"i{i}", *size) for i, size in enumerate(sizes)]
        results = self.predict_gaining(*symbols, self.step_covariance)
        return ca.Function("predict", symbols, results)

    @cached_property
    def predict_gaining(self) -> ca.Function:
        """(X, P, u, d, p, Q) -> (X, P, F) with what X gains in a step."""
        plant, model = self.plant, self.plant.model
        n, n_w = len(model.states), len(self.unknown_inputs)
        X, P = ca.MX.sym("X", n + n_w), ca.MX.sym("P", n + n_w, n + n_w)
        u = ca.MX.sym("u", len(model.commands), self.decimate)
        d = ca.MX.sym("d", len(model.measured_inputs), self.decimate)
        p = ca.MX.sym("p", len(model.parameters))
        S = self.scale
        x, w = S[:n] * X[:n], S[n:] * X[n:, 0]
        F = self.transition(X, u[:, 0], d[:, 0], p)
        Q = ca.MX.sym("Q", n + n_w, n + n_w)
        step = self.step
        for k in range(self.decimate):
            x = step(x, u[:, k], d[:, k], ca.vertcat(p, w))
        later = ca.vertcat(x / plant.scale, X[n:, 0])
        P_later = F @ (P + Q / 2) @ F.T + Q / 2
        return ca.Function("predict", [X, P, u, d, p, Q], [later, P_later, F])

    def transition(self, X: ca.MX, u: ca.MX, d: ca.MX, p: ca.MX) -> ca.MX:
        """F of a step of the filter from X on, see the module."""
        model, n, n_w = self.plant.model, len(self.plant.scale), len(self.unknown_inputs)
        S = self.scale
        x, now = S[:n] * X[:n], p + ca.DM(self._wandering) @ (S[n:] * X[n:, 0])
        A = model.jacobians(x, u, d, now)[0] * np.outer(1 / S[:n], S[:n])
        coupling = self._entering_at(x, u, d, now) * np.outer(1 / S[:n], S[n:])
        A = ca.blockcat([[A, coupling], [ca.MX(n_w, n), ca.MX(n_w, n_w)]])
        return transition(A, self.sample_time_s * self.decimate)

    @cached_property
    def correct(self) -> ca.Function:
        """(X, P, u, d, p, y, received) -> (X, P, innovation, spread, log-likelihood, i, J, L, G).

        i = H' S^-1 e and J = H' S^-1 H are what the measurement says, L = I - K H what it leaves;
        G = [K, H' S^-1], with outputs in units of their noise.  ``received`` is 1 or 0 by output;
        a missing value of y may hold any finite number.
        """
        told = self.correct_with_nis
        symbols = [ca.MX.sym(f"i{i}", *told.size_in(i)) for i in range(told.n_in())]
        return ca.Function("correct", symbols, told(*symbols)[:-1])

    @cached_property
    def correct_with_nis(self) -> ca.Function:
        """:attr:`correct`, and last the innovation squared over its covariance, e' S^-1 e."""
        model, n = self.plant.model, len(self.plant.scale)
        size, n_y = len(self.scale), len(model.measured)
        X, P = ca.MX.sym("X", size), ca.MX.sym("P", size, size)
        u, d, p = (ca.MX.sym(k, s.numel()) for k, s in zip("udp", model.symbols[1:], strict=True))
        y, received = ca.MX.sym("y", n_y), ca.MX.sym("received", n_y)
        r = np.array([self.measurement_noise[name] for name in model.measured])
        real = self.scale * X
        expected, C = self.outputs(real[:n], real[n:, 0], u, d, p)
        C = C * np.outer(1 / r, self.scale)  # outputs in units of their noise
        H = C * ca.repmat(received, 1, size)
        e = received * (y - expected) / r
        S = H @ P @ H.T + ca.MX.eye(n_y)
        K = self.corrected[:, None] * ca.solve(S, H @ P).T
        rest = ca.MX.eye(size) - K @ H
        weighted = ca.solve(S, ca.horzcat(e, H))
        nis = e.T @ ca.solve(S, e)
        likely = -0.5 * (nis + ca.log(ca.det(S)) + ca.dot(received, np.log(2 * np.pi * r**2)))
        results = [X + K @ e, rest @ P @ rest.T + K @ K.T, e * r, ca.sqrt(ca.diag(S)) * r, likely]
        results += [H.T @ weighted[:, 0], H.T @ weighted[:, 1:], rest]
        results += [ca.horzcat(K, weighted[:, 1:].T), nis]
        return ca.Function("correct", [X, P, u, d, p, y, received], results)

    @cached_property
    def sample(self) -> ca.Function:
        """One sample: correct what was predicted for it, then predict the next.

        (X, P, u, d, p, y, received, Q) with X and P predicted and Q what X gains in a step ->
        (X and P predicted for the next sample, F, then what :attr:`correct` gives)
        """
        once, following = self.correct, self.predict_gaining
        symbols = [ca.MX.sym(f"i{i}", *once.size_in(i)) for i in range(once.n_in())]
        symbols[2:4] = (ca.MX.sym(k, *following.size_in(i)) for i, k in ((2, "u"), (3, "d")))
        X, P, u, d, p, y, received = symbols
        Q = ca.MX.sym("Q", *following.size_in(5))
        now = once(X, P, u[:, 0], d[:, 0], p, y, received)
        later = following(now[0], now[1], u, d, p, Q)
        return ca.Function("sample", [*symbols, Q], [*later, *now])

    @cached_property
    def likelihood(self) -> ca.Function:
        """:attr:`sample` for its log-likelihood alone: (now, u, d, p, y, received) -> later.

        Both hold X, P, Q and the sum of the log-likelihood, column by column in one vector.
        """
        *symbols, Q = (ca.MX.sym(f"i{i}", *self.sample.size_in(i)) for i in range(8))
        X, P, *inputs = symbols
        before = ca.MX.sym("before")
        later = self.sample(*symbols, Q)
        now = ca.veccat(X, P, Q, before)
        once = ca.Function(
            "once", [X, P, Q, before, *inputs], [ca.veccat(*later[:2], Q, before + later[7])]
        )
        packed = ca.MX.sym("now", now.numel())
        parts = ca.vertsplit(packed, np.cumsum([0, *(v.numel() for v in (X, P, Q, before))]))
        unpacked = (
            ca.reshape(v, *to.shape) for v, to in zip(parts, (X, P, Q, before), strict=True)
        )
        return ca.Function("likelihood", [packed, *inputs], [once(*unpacked, *inputs)])

    @cached_property
    def outputs(self) -> ca.Function:
        """(x, w, u, d, p) -> (y, dy/d(x, w))."""
        x, u, d, p = self.plant.model.symbols
        w = ca.SX.sym("w", len(self.unknown_inputs))
        y = ca.substitute(self.plant.model.outputs, p, p + ca.DM(self._wandering) @ w)
        return ca.Function("outputs", [x, w, u, d, p], [y, ca.jacobian(y, ca.vertcat(x, w))])

    @property
    def _entering(self) -> np.ndarray:
        """E: which state rate each unknown input adds to, shape (n_x, n_w)."""
        return np.array(
            [[float(name == w) for w in self.unknown_inputs] for name in self.plant.model.states]
        ).reshape(len(self.plant.scale), -1)

    @property
    def _wandering(self) -> np.ndarray:
        """S: which parameter each unknown input is added to, shape (n_p, n_w)."""
        names = self.plant.model.parameters
        return np.array(
            [[float(name == w) for w in self.unknown_inputs] for name in names]
        ).reshape(len(names), -1)

    @cached_property
    def _entering_at(self) -> ca.Function:
        """(x, u, d, p) -> how each state rate answers each unknown input, shape (n_x, n_w)."""
        model = self.plant.model
        wandering = [k for k, name in enumerate(model.parameters) if name in self.unknown_inputs]
        p = model.symbols[3]
        slopes = ca.jacobian(model.rates, p[wandering]) @ ca.DM(self._wandering[wandering])
        entering = slopes + ca.DM(self._entering)
        return ca.Function("entering", [*model.symbols], [ca.densify(entering)])

    @property
    def corrected(self) -> np.ndarray:
        """1 for what a measurement corrects, 0 for bristles and the considered, (n_x + n_w,)."""
        sliding = (m.name for m in self.plant.members if isinstance(m, BristleFriction))
        left = {*self.considered, *(f"{name}.deflection_m" for name in sliding)}
        free = [float(name not in left) for name in self.plant.model.states]
        return np.array([*free, *[1.0] * len(self.unknown_inputs)])

    @cached_property
    def step(self) -> ca.Function:
        """(x, u, d, (p, w)) -> x one sample later; a state that is lost stays as it is.

        The integrator would try the finest of its steps on every sample of it.
        """
        advance = self._advance
        x, u, d, p = (ca.MX.sym(k, advance.numel_in(i)) for i, k in enumerate("xudp"))
        lost = ca.Function("lost", [x, u, d, p], [x], [*"xudp"], ["x_next"])
        either = ca.Function.if_else("either", advance, lost)
        later = either(ca.sumsqr(x / self.plant.scale) < inf, x, u, d, p)
        return ca.Function("step", [x, u, d, p], [later], [*"xudp"], ["x_next"])

    @cached_property
    def _advance(self) -> ca.Function:
        """(x, u, d, (p, w)) -> x one sample later, machine code where there is a compiler."""
        if not self.unknown_inputs:
            return self.plant.model.compiled_step(self.sample_time_s)
        return compiled(self.advance)

    @cached_property
    def advance(self) -> ca.Function:
        """(x, u, d, (p, w)) -> x one sample later, for building."""
        model, dt = self.plant.model, self.sample_time_s
        if not self.unknown_inputs:
            return model.step(dt)
        x, u, d, p = model.symbols
        w = ca.SX.sym("w", len(self.unknown_inputs))
        rates = ca.substitute(model.rates, p, p + ca.DM(self._wandering) @ w)
        rates += ca.DM(self._entering) @ w
        return controlled_step((x, u, d, ca.vertcat(p, w)), rates, dt, model.tolerances)

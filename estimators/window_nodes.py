"""What happens at one node of a horizon, as CasADi functions: advance, see, correct, look back.

X holds scaled states, random walks and constants as :class:`PlantFilter` orders them, d is X less
that of the path along which all is linearised.  Outputs are in units of their noise and count one
after the other, so that nothing is inverted and a missing one has weight 0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np

from estimators.losses import Loss, Squared
from workbench.plant_filter import PlantFilter
from workbench.rosenbrock import controlled_step, single_step, steps_of

JITTER, LEAST = 1e-10, 1e-14  # of a variance, where a cost asks for its inverse; and at least


@dataclass(frozen=True, kw_only=True)
class WindowNodes:
    """The functions of one node; see :class:`Horizon` for the fields."""

    found: PlantFilter
    constants: int
    loss: Loss
    coarsest_s: float

    @property
    def n(self) -> int:
        """Entries of X."""
        return len(self.found.scale)

    @property
    def n_y(self) -> int:
        """Outputs."""
        return len(self.found.plant.measured)

    @cached_property
    def kick(self) -> np.ndarray:
        """Root of half the variance that X gains in a sample, shape (n,); constants gain none."""
        kick = np.sqrt(self.found.step_covariance.diagonal() / 2.0)
        kick[self.n - self.constants :] = 0.0
        return kick

    @cached_property
    def advance(self) -> ca.Function:
        """(X, noise, moved, u, held, d, p) -> (X, F) one sample later.

        ``noise`` is (a, b) of :mod:`estimators.horizon`, ``held`` what :attr:`hold` gives; where
        ``moved`` is 0, X stays and F is the unit matrix.  Steps whose error is too large, as at an
        impact, are done again in finer ones; F is then that of the extended filter, which is damped
        where the step's would explode.
        """
        trial = self._trial
        symbols = [ca.MX.sym(f"i{k}", *trial.size_in(k)) for k in range(trial.n_in())]
        X, F = ca.MX.sym("X", self.n), ca.MX.sym("F", self.n, self.n)
        keep = ca.Function("keep", [X, F, *symbols], [X, F])
        again = ca.Function("again", [X, F, *symbols], self._refined(*symbols))
        X, F, passes = trial(*symbols)
        results = ca.Function.if_else("chosen", keep, again)(passes, X, F, *symbols)
        return ca.Function("advance", symbols, results)

    @cached_property
    def _trial(self) -> ca.Function:
        """(X, noise, moved, u, held, d, p) -> (X, F, true where no step is to be done again)."""
        (x, u, d, pw), _ = self._rates
        held, _, rates = self._constant
        symbols = (x, ca.vertcat(u, held), d, pw)
        steps = steps_of(self.found.sample_time_s, self.coarsest_s)
        n_p, n_x = len(self.found.plant.model.parameters), len(self.found.plant.scale)
        later, error = single_step(symbols, rates)(*symbols, self.found.sample_time_s / steps)
        small = ca.sumsqr(error / self.found.plant.model.tolerances) < 1.0
        by = [ca.densify(ca.jacobian(later, v)) for v in (x, pw[n_p:])]
        once = ca.Function("once", [*symbols], [later, *by, small], {"cse": True})
        kind = ca.SX if steps == 1 else ca.MX  # several are a chain of calls, or the code is long
        X, noise, moved, u, held, d, p, kicked = self._inputs(kind)
        real = ca.DM(self.found.scale) * kicked
        now, w, passes, carried = real[:n_x], real[n_x:, 0], 1.0, None
        for _ in range(steps):
            now, by_x, by_w, small = once(now, ca.vertcat(u, held), d, ca.vertcat(p, w))
            passes = passes * small
            if carried is None:
                carried = ca.horzcat(by_x, by_w)
            else:
                carried = by_x @ carried + ca.horzcat(kind(n_x, n_x), by_w)
        return ca.Function(
            "trial",
            [X, noise, moved, u, held, d, p],
            [*self._scaled(X, noise, moved, ca.vertcat(now, w), carried), passes],
            {"cse": True},
        )

    def _inputs(self, kind: type) -> list:
        """Symbols X, noise, moved, u, held, d, p, and X with the first half of the noise."""
        n, (_, *inputs) = self.n, self.found.plant.model.symbols
        X, noise, moved = kind.sym("X", n), kind.sym("noise", 2 * n), kind.sym("moved")
        u, d, p = (kind.sym(k, s.numel()) for k, s in zip("udp", inputs, strict=True))
        held = kind.sym("held", self.hold.numel_out(0))
        return [X, noise, moved, u, held, d, p, X + moved * ca.DM(self.kick) * noise[:n]]

    def _scaled(self, X, noise, moved, later, slopes) -> list:
        """X and F in scaled units from what follows on (x, w), and its slopes in (x, w)."""
        n, n_x, S = self.n, len(self.found.plant.scale), self.found.scale
        ahead = later / ca.DM(S) + moved * ca.DM(self.kick) * noise[n:]
        still = 1.0 - moved
        unit = ca.DM.eye(n)
        F = ca.vertcat(slopes * ca.DM(np.outer(1.0 / S[:n_x], S)), ca.densify(unit[n_x:, :]))
        return [moved * ahead + still * X, ca.densify(moved * F + still * unit)]

    @cached_property
    def _refined(self) -> ca.Function:
        """(X, noise, moved, u, held, d, p) -> (X with as fine steps as it takes, F)."""
        n_x, S = len(self.found.plant.scale), ca.DM(self.found.scale)
        X, noise, moved, u, held, d, p, kicked = self._inputs(ca.MX)
        real = S * kicked
        dt, tolerances = self.found.sample_time_s, self.found.plant.model.tolerances
        step = controlled_step(*self._rates, dt, tolerances, self.coarsest_s)
        later = ca.vertcat(step(real[:n_x], u, d, ca.vertcat(p, real[n_x:, 0])), real[n_x:, 0])
        ahead = later / S + moved * ca.DM(self.kick) * noise[self.n :]
        F = moved * self.found.transition(kicked, u, d, p) + (1.0 - moved) * ca.MX.eye(self.n)
        results = [moved * ahead + (1.0 - moved) * X, ca.densify(F)]
        return ca.Function("refined", [X, noise, moved, u, held, d, p], results)

    @cached_property
    def see(self) -> ca.Function:
        """(X, u, d, p) -> (y, H)."""
        model, n_x = self.found.plant.model, len(self.found.plant.scale)
        X = ca.SX.sym("X", self.n)
        real = ca.SX(ca.DM(self.found.scale)) * X
        x, u, d, p = model.symbols
        now = p + ca.SX(ca.DM(self._walking)) @ real[n_x:, 0]
        (y,) = ca.substitute([model.outputs], [x, p], [real[:n_x], now])
        noise = [self.found.measurement_noise[name] for name in model.measured]
        y = y / ca.DM(noise)
        return ca.Function("see", [X, u, d, p], [y, ca.densify(ca.jacobian(y, X))])

    @cached_property
    def correct(self) -> ca.Function:
        """((d, P), error, received, H) -> ((d, P), gains) with the outputs of this node.

        ``error`` is y less that of the path.  Gains have a column for each output: innovation over
        its variance, root of its weight, gain.
        """
        n, n_y = self.n, self.n_y
        dP, H = ca.SX.sym("dP", n, n + 1), ca.SX.sym("H", n_y, n)
        error, received = ca.SX.sym("error", n_y), ca.SX.sym("received", n_y)
        root = ca.sqrt(received * self.loss.weight(error))
        d, P, gains = dP[:, 0], dP[:, 1:], []
        for j in range(n_y):
            h = root[j] * H[j, :].T
            Ph = P @ h
            variance = 1.0 + ca.dot(h, Ph)
            e = (root[j] * error[j] - ca.dot(h, d)) / variance
            K = Ph / variance
            d = d + variance * e * K
            P = P - K @ Ph.T
            gains.append(ca.vertcat(e, root[j], K))
        results = [ca.densify(ca.horzcat(d, P)), ca.densify(ca.horzcat(*gains))]
        return ca.Function("correct", [dP, error, received, H], results, {"cse": True})

    @cached_property
    def forward(self) -> ca.Function:
        """((d, P), error, received, H, F, noise, moved) -> ((d, P) at the next node, gains)."""
        n = self.n
        symbols = [ca.SX.sym(f"i{k}", *self.correct.size_in(k)) for k in range(4)]
        F, noise, moved = ca.SX.sym("F", n, n), ca.SX.sym("noise", 2 * n), ca.SX.sym("moved")
        now, gains = self.correct(*symbols)
        kick = moved * ca.DM(self.kick)
        d = F @ (now[:, 0] - kick * noise[:n]) - kick * noise[n:]
        half = ca.diag(kick**2)
        P = F @ (now[:, 1:] + half) @ F.T + half
        results = [ca.densify(ca.horzcat(d, P)), gains]
        return ca.Function("forward", [*symbols, F, noise, moved], results, {"cse": True})

    @cached_property
    def before(self) -> ca.Function:
        """(adjoint behind the outputs of a node, gains, H) -> adjoint before them.

        An adjoint is P^-1 times what X is moved by all that is known later (Bryson and Frazier).
        """
        n, n_y = self.n, self.n_y
        adjoint, gains = ca.SX.sym("adjoint", n), ca.SX.sym("gains", n + 2, n_y)
        H, moved = ca.SX.sym("H", n_y, n), adjoint
        for j in reversed(range(n_y)):
            h = gains[1, j] * H[j, :].T
            moved = moved + h * (gains[0, j] - ca.dot(gains[2:, j], moved))
        return ca.Function("before", [adjoint, gains, H], [moved])

    @cached_property
    def backward(self) -> ca.Function:
        """(adjoint at the next node, gains, H, F, moved) -> (adjoint at this one, noise)."""
        n, n_y = self.n, self.n_y
        adjoint, gains = ca.SX.sym("adjoint", n), ca.SX.sym("gains", n + 2, n_y)
        H, F, moved = ca.SX.sym("H", n_y, n), ca.SX.sym("F", n, n), ca.SX.sym("moved")
        through, kick = F.T @ adjoint, moved * ca.DM(self.kick)
        noise = ca.densify(ca.vertcat(kick * through, kick * adjoint))
        results = [self.before(through, gains, H), noise]
        return ca.Function("backward", [adjoint, gains, H, F, moved], results, {"cse": True})

    @cached_property
    def surprise(self) -> ca.Function:
        """((d, P), error, received, H) -> innovation squared over its covariance, of a node.

        Without the weights of the loss: what it lets go is as surprising as it is.
        """
        plain = replace(self, loss=Squared()).correct
        symbols = [ca.SX.sym(f"i{k}", *plain.size_in(k)) for k in range(4)]
        (_, gains), received, H = plain(*symbols), symbols[2], symbols[3]
        nis = ca.SX(0.0)
        for j in range(self.n_y):  # a gain K tells the variance: 1 - h K = 1 / variance
            h = received[j] * H[j, :].T
            nis += gains[0, j] ** 2 / (1.0 - ca.dot(h, gains[2:, j]))
        return ca.Function("surprise", symbols, [nis], {"cse": True})

    @cached_property
    def costs(self) -> ca.Function:
        """(error, received) -> what the errors of a node cost."""
        error, received = ca.SX.sym("error", self.n_y), ca.SX.sym("received", self.n_y)
        cost = ca.dot(received, self.loss.cost(error))
        return ca.Function("costs", [error, received], [cost])

    @cached_property
    def priced(self) -> ca.Function:
        """(X less its prior, P) -> (X - prior)' P^-1 (X - prior)."""
        off, P = ca.SX.sym("off", self.n), ca.SX.sym("P", self.n, self.n)
        sure = P + ca.diag(JITTER * ca.diag(P) + LEAST)
        solved = ca.ldl_solve(off, *ca.ldl(sure))
        return ca.Function("priced", [off, P], [ca.dot(off, solved)], {"cse": True})

    @property
    def _walking(self) -> np.ndarray:
        """Which parameter each unknown input is added to, shape (n_p, n_w)."""
        names = self.found.plant.model.parameters
        return np.array(
            [[float(name == w) for w in self.found.unknown_inputs] for name in names]
        ).reshape(len(names), -1)

    @cached_property
    def hold(self) -> ca.Function:
        """(u, d, p) -> what in the rates is constant while u is held, as the opening of a valve.

        It is worked out once for a node, not in every pass through the window.
        """
        _, *inputs = self.found.plant.model.symbols
        return ca.Function("hold", inputs, [self._constant[1]])

    @cached_property
    def _constant(self) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Symbols for what u makes constant, its expressions in u, d and p, the rates with them."""
        (_, u, d, _), rates = self._rates
        inputs = ca.vertcat(u, d, self.found.plant.model.symbols[3])
        rates, symbols, values = ca.extract_parametric(rates, inputs)
        of_u = np.array([ca.depends_on(value, u) for value in values], dtype=bool)
        symbols, values = (ca.vertcat(ca.SX(0, 1), *each) for each in (symbols, values))
        rest, kept = (np.flatnonzero(chosen).tolist() for chosen in (~of_u, of_u))
        rates = ca.substitute(rates, symbols[rest, :], values[rest, :])
        return symbols[kept, :], values[kept, :], rates

    @cached_property
    def _rates(self) -> tuple[tuple[ca.SX, ...], ca.SX]:
        """The symbols x, u, d, (p, w) and the rates with the unknown inputs in them."""
        model = self.found.plant.model
        x, u, d, p = model.symbols
        w = ca.SX.sym("w", len(self.found.unknown_inputs))
        entering = [[float(s == name) for name in self.found.unknown_inputs] for s in model.states]
        rates = ca.substitute(model.rates, p, p + ca.DM(self._walking) @ w)
        rates += ca.DM(np.array(entering).reshape(x.numel(), -1)) @ w
        return (x, u, d, ca.vertcat(p, w)), rates

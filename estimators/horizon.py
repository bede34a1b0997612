"""The window of a moving-horizon estimator as CasADi functions, without a Python loop over samples.

Unknown are the first state of the window and the noise of every sample since,

    X_0 = prior + P^(1/2) .,    X_k+1 = step(X_k + (Q/2)^(1/2) a_k, u_k) + (Q/2)^(1/2) b_k

One Gauss-Newton step is condensed: with the sensitivities of every sample along the path, a Kalman
pass forwards leaves a quadratic in the newest X alone, where bounds are looked after, and a pass
backwards gives the X_0 and the noise that belong to it.  Then the plant runs through the window
from there; the sensitivities along that run serve the next sample.

What leaves the window enters the prior by the same forward pass: the arrival cost of an extended
Kalman filter.  Nodes before the start are there, but nothing moves between them.

Source: Bell 1994, "The iterated Kalman smoother as a Gauss-Newton method"; Rao, Rawlings and Mayne
2003, "Constrained state estimation for nonlinear discrete-time systems", for the arrival cost;
Diehl, Bock and Schloeder 2005, "A real-time iteration scheme for nonlinear optimization in optimal
feedback control", for one iteration per sample and the shift.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from estimators.losses import Loss
from estimators.window_nodes import WindowNodes
from workbench.called import prepared
from workbench.compiled import compiled
from workbench.plant_filter import PlantFilter

Parts = dict[str, ca.MX]
Call = Callable[..., list[np.ndarray]]


@dataclass(frozen=True)
class Window:
    """What an estimate carries: the tape of :class:`Horizon`, and the newest X with covariance."""

    tape: np.ndarray
    X: np.ndarray
    P: np.ndarray


@dataclass(frozen=True)
class Step:
    """A step: the window behind it, its length, if bounds were active, and the sample's ``nis``."""

    window: Window
    length: float
    bounded: bool
    nis: float


@dataclass(frozen=True, kw_only=True)
class Horizon:
    """The functions of a window.  All that is known of it stands in one column, the tape.

    Attributes
    ----------
    found
        The filter whose states, noise and outputs the window has.
    constants
        How many of its last unknown inputs are constant over the window.  Before each sample their
        prior is the last estimate, with their intensity as standard deviation of the movement.
    nodes
        Samples in the window, the newest included.
    arrival
        Variance that the arrival cost gains per sample, shape (n,).
    loss
        What errors of the measurements cost.
    coarsest_s
        Longest step of the integrator.
    """

    found: PlantFilter
    constants: int
    nodes: int
    arrival: np.ndarray
    loss: Loss
    coarsest_s: float

    @cached_property
    def sizes(self) -> dict[str, tuple[int, int]]:
        """Shape of every part of the tape, nodes side by side."""
        n, n_y, M = self.at.n, self.at.n_y, self.nodes
        return {
            "prior": (n, n + 1),  # of X_0: mean, covariance
            "handed": (n, n + 1),  # the same of X_1
            "points": (n, M),
            "noise": (2 * n, M - 1),
            "F": (n, n * (M - 1)),
            "expected": (n_y, M),
            "H": (n_y, n * M),
            "y": (n_y, M),
            "received": (n_y, M),
            "u": (len(self.found.plant.commands), M),
            "held": (self.at.hold.numel_out(0), M),
            "moved": (1, M - 1),
        }

    def part(self, tape: np.ndarray, name: str) -> np.ndarray:
        """One part of a tape, a view of it."""
        where, shape = self._places[name]
        return tape[where].reshape(shape, order="F")

    @cached_property
    def _places(self) -> dict[str, tuple[slice, tuple[int, int]]]:
        """Where each part stands on the tape, and its shape."""
        ends = np.cumsum([0, *(rows * columns for rows, columns in self.sizes.values())]).tolist()
        spans = map(slice, ends, ends[1:])
        return {
            name: (span, self.sizes[name]) for name, span in zip(self.sizes, spans, strict=True)
        }

    def begun(self, X: np.ndarray, P: np.ndarray) -> np.ndarray:
        """A tape on which nothing has happened yet; X (n,) is known with covariance P (n, n)."""
        tape = np.zeros(self._length)
        known = np.column_stack([X, P])
        filled = dict(prior=known, handed=known, points=X[:, None], F=np.eye(len(X)))
        for name, value in filled.items():
            part = self.part(tape, name)
            part[:] = np.tile(value, part.shape[1] // value.shape[1])
        u, d, p = self.found.plant.nominal
        self.part(tape, "u")[:] = u[:, None]
        self.part(tape, "held")[:] = self.at.hold(u, d, p).full()
        return tape

    @property
    def _length(self) -> int:
        return sum(rows * columns for rows, columns in self.sizes.values())

    @cached_property
    def sample(self) -> Call:
        """(tape, news, d, p) -> (tape, told) one sample later, after one full Gauss-Newton step.

        ``news`` is the command since the last sample, then y over its noise, then what of it was
        received.  ``told`` is the cost before and after the step, then as :attr:`solve` tells it.
        """
        tape, news, d, p = self._symbols("tape", "news", "d", "p")
        solved, (before, *newest) = self._solved(self._moved(tape, news, d, p), 0.0)
        later, after = self._run(solved, d, p)
        results = [self._tape(later), ca.veccat(before, after, *newest)]
        return _ready("mhe_sample", [tape, news, d, p], results)

    @cached_property
    def move(self) -> Call:
        """(tape, news, d, p) -> the tape one sample later, before a step; rare, so not compiled."""
        tape, news, d, p = self._symbols("tape", "news", "d", "p")
        results = [self._tape(self._moved(tape, news, d, p))]
        return prepared(ca.Function("mhe_move", [tape, news, d, p], results))

    @cached_property
    def solve(self) -> Call:
        """(tape, push) -> (tape, told): the first X and the noise of the linear problem.

        ``push`` is P^-1 times what bounds move the newest X by.  ``told`` is the cost before the
        step, then d and P: the newest X less that of the path, without bounds, and its covariance,
        and ``nis``: the innovation squared over its covariance.
        """
        tape, push = self._symbols("tape", "push")
        solved, told = self._solved(self._parts(tape), push)
        return _ready("mhe_solve", [tape, push], [self._tape(solved), ca.veccat(*told)])

    @cached_property
    def run(self) -> Call:
        """(tape, d, p) -> (tape, cost): the plant runs from the first point under the noise."""
        tape, d, p = self._symbols("tape", "d", "p")
        later, cost = self._run(self._parts(tape), d, p)
        return _ready("mhe_run", [tape, d, p], [self._tape(later), cost])

    @cached_property
    def at(self) -> WindowNodes:
        """What happens at one node."""
        return WindowNodes(
            found=self.found, constants=self.constants, loss=self.loss, coarsest_s=self.coarsest_s
        )

    def _symbols(self, *names: str) -> list[ca.MX]:
        _, *inputs = self.found.plant.model.symbols
        n_u, n_d, n_p = (s.numel() for s in inputs)
        sizes = dict(tape=self._length, news=n_u + 2 * self.at.n_y, push=self.at.n, d=n_d, p=n_p)
        return [ca.MX.sym(name, sizes[name]) for name in names]

    def _parts(self, tape: ca.MX) -> Parts:
        ends = np.cumsum([0, *(rows * columns for rows, columns in self.sizes.values())]).tolist()
        pieces = zip(self.sizes.items(), ca.vertsplit(tape, ends), strict=True)
        return {name: ca.reshape(piece, *shape) for (name, shape), piece in pieces}

    def _tape(self, parts: Parts) -> ca.MX:
        return ca.veccat(*(ca.densify(parts[name]) for name in self.sizes))

    def _moved(self, tape: ca.MX, news: ca.MX, d: ca.MX, p: ca.MX) -> Parts:
        """Shifted by a sample, the newest node where the last path leads."""
        old, n, n_y = self._parts(tape), self.at.n, self.at.n_y
        u, y, received = news[: -2 * n_y], news[-2 * n_y : -n_y], news[-n_y:]
        held = self.at.hold(u, d, p)
        X, F = self.at.advance(old["points"][:, -1], ca.MX(2 * n, 1), 1.0, u, held, d, p)
        expected, H = self.at.see(X, u, d, p)
        new = dict(points=X, expected=expected, H=H, y=y, received=received, u=u, held=held)
        new |= dict(noise=ca.MX(2 * n, 1), F=F, moved=ca.MX(1.0))
        for name, value in (("u", u), ("held", held)):  # from the last node to the new one
            old[name] = ca.horzcat(old[name][:, :-1], value)
        shifted = {k: ca.horzcat(old[k][:, v.shape[1] :], v) for k, v in new.items()}
        prior = self._arrived(old)
        return shifted | dict(prior=prior, handed=prior)

    def _arrived(self, old: Parts) -> ca.MX:
        """Prior of the second node.

        Constants are known from the last estimate, less movement.  Bristles are where the path has
        them: bent along a tangent by what the prior does not know, they would bend too far.
        """
        free, bound = self.at.n - self.constants, ca.DM(self.found.corrected)
        mean, P = old["handed"][:, 0], old["handed"][:, 1:]
        mean = bound * mean + (1.0 - bound) * old["points"][:, 1]
        P = (P + old["moved"][0] * ca.diag(ca.DM(self.arrival))) * (bound @ bound.T)
        movement = self.found.sample_time_s * ca.DM.eye(self.constants)
        mean = ca.vertcat(mean[:free], old["points"][free:, -1])
        return ca.horzcat(mean, ca.densify(ca.diagcat(P[:free, :free], movement)))

    def _solved(self, now: Parts, push: ca.MX | float) -> tuple[Parts, tuple[ca.MX, ...]]:
        """First X, noise and what is handed on, then (cost before, d, P, nis) of the newest X."""
        M, points = self.nodes, now["points"]
        error = now["y"] - now["expected"]
        outputs = (error, now["received"], now["H"])
        begun = ca.horzcat(now["prior"][:, 0] - points[:, 0], now["prior"][:, 1:])
        ahead, gains = self.at.forward.mapaccum("forward", M - 1, 1)(
            begun, *map(self._first, outputs), now["F"], now["noise"], now["moved"]
        )
        width = begun.shape[1]
        newest, last = self.at.correct(ahead[:, -width:], *map(self._last, outputs))
        adjoint = self.at.before(push, last, self._last(now["H"]))
        every = (gains, self._first(now["H"]), now["F"], now["moved"])
        adjoints, noise = self.at.backward.mapaccum("backward", M - 1, 1)(
            adjoint, *map(self._reversed, every)
        )
        start = now["prior"][:, 0] + now["prior"][:, 1:] @ adjoints[:, -1]
        handed = ca.horzcat(points[:, 1] + ahead[:, 0], ahead[:, 1:width])
        later = dict(points=ca.horzcat(start, points[:, 1:]), noise=self._reversed(noise))
        nis = self.at.surprise(ahead[:, -width:], *map(self._last, outputs))
        told = self._cost(now), newest[:, 0], newest[:, 1:], nis
        return now | later | dict(handed=handed), told

    def _run(self, now: Parts, d: ca.MX, p: ca.MX) -> tuple[Parts, ca.MX]:
        """The path from the first point under the noise, all along it, and its cost."""
        M, first = self.nodes, now["points"][:, 0]
        many = (ca.repmat(d, 1, M), ca.repmat(p, 1, M))
        later, F = self.at.advance.mapaccum("advance", M - 1, 1)(
            first, now["noise"], now["moved"], *map(self._first, (now["u"], now["held"], *many))
        )
        points = ca.horzcat(first, later)
        expected, H = self.at.see.map(M)(points, now["u"], *many)
        found = now | dict(points=points, F=F, expected=expected, H=H)
        return found, self._cost(found)

    def _cost(self, now: Parts) -> ca.MX:
        costs = self.at.costs.map(self.nodes)(now["y"] - now["expected"], now["received"])
        off = now["points"][:, 0] - now["prior"][:, 0]
        prior = self.at.priced(off, now["prior"][:, 1:])
        return ca.sum2(costs) + prior + ca.sumsqr(now["noise"])

    def _first(self, value: ca.MX) -> ca.MX:
        """All nodes but the newest."""
        return value[:, : value.shape[1] // self.nodes * (self.nodes - 1)]

    def _last(self, value: ca.MX) -> ca.MX:
        """The newest node."""
        return value[:, value.shape[1] // self.nodes * (self.nodes - 1) :]

    def _reversed(self, value: ca.MX) -> ca.MX:
        """All nodes but the newest, the last of them first."""
        width = value.shape[1] // (self.nodes - 1)
        columns = np.arange(value.shape[1]).reshape(-1, width)[::-1].ravel()
        return value[:, columns.tolist()]


def _ready(name: str, symbols: list[ca.MX], results: list[ca.MX]) -> Call:
    """A function of columns, machine code where there is a compiler."""
    return prepared(compiled(ca.Function(name, symbols, results)))

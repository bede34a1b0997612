"""Moving-horizon estimation on the plant itself: states, unknown inputs and constants of a window.

    min over X_0 .. X_N   |X_0 - prior|^2_P  +  sum |X_k+1 - step(X_k, u_k)|^2_Q
                          + sum rho((y_k - h(X_k)) / r),     lower <= X_N <= upper

One Gauss-Newton step per sample (real-time iteration) from the last path, shifted; see
:class:`Horizon` for how it is taken.  A step that does not lower the cost is halved.  Bounds that
the step would pass are held by a small QP, exact because the problem condenses to X_N; what is
constant over the window keeps them in all of it.  Where no step lowers the cost, something is not
finite, the newest sample is missed by far, or the answer comes late, the estimate is that of the
extended Kalman filter, and the notes say so.

On a linear plant with squared errors every step is exact and the estimate is the Kalman filter's.

Source: Rao, Rawlings and Mayne 2003, "Constrained state estimation for nonlinear discrete-time
systems"; Diehl, Bock and Schloeder 2005, "A real-time iteration scheme".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf
from time import perf_counter

import numpy as np

from estimators.extended_kalman import ExtendedKalman
from estimators.horizon import Horizon, Step, Window
from estimators.losses import Loss, Squared
from estimators.nearest_inside import OutsideError, nearest_inside
from estimators.stochastic_plant import StochasticPlant
from workbench.contracts import Estimate
from workbench.plant import require
from workbench.rosenbrock import COARSEST_STEP_S

HALVINGS = 4
GROWTH, ROUNDING = 1e-3, 1e-9  # share and size by which a step may raise the cost: at rest, the
# kinks of friction leave no direction that lowers it
FAR = 10.0  # standard deviations of a sensor


def allowed(cost: float) -> float:
    """The highest cost that a step may lead to from this one."""
    return cost * (1.0 + GROWTH) + ROUNDING


def sound(P: np.ndarray) -> bool:
    """Variances that can be: finite, and below zero only by rounding."""
    return all(-(ROUNDING**2) <= variance < inf for variance in P.diagonal().tolist())


class LostError(ArithmeticError):
    """No step lowers the cost, or something is not finite."""


@dataclass(frozen=True, kw_only=True)
class MovingHorizon(StochasticPlant):
    """An estimator that looks back over ``horizon`` samples; see the module.

    In the window, too, states and unknown inputs wander by their noise.

    Attributes
    ----------
    constants
        Parameters that are one value over the window, by ``part.parameter_unit``, with the standard
        deviation of their movement from one sample to the next: the smaller, the dearer.
    bounds
        (lower, upper) of states, unknown inputs and constants, the last as values; at the newest
        sample.
    loss
        What errors of the measurements cost.
    arrival_noise
        What a state gains besides, per square root of a second, in the arrival cost alone: trust in
        the start of a window whose inside has no noise.
    passes
        Gauss-Newton steps per sample.
    deadline_s
        What takes longer is late.
    coarsest_s
        Longest step of the integrator.

    Raises
    ------
    ValueError
        For a horizon below two samples, a movement or passes not above zero, or a bound whose lower
        end is not below its upper one.
    UnknownNameError
        For names that the plant does not have.
    """

    constants: Mapping[str, float] = field(default_factory=dict)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    loss: Loss = Squared()
    arrival_noise: Mapping[str, float] = field(default_factory=dict)
    horizon: int = 4
    passes: int = 1
    deadline_s: float = inf
    coarsest_s: float = COARSEST_STEP_S

    def __post_init__(self) -> None:
        name, model = self.plant.name, self.plant.model
        if self.horizon < 2 or self.passes < 1:
            raise ValueError(f"{name}: a horizon has 2 samples and 1 pass at least")
        require(self.constants, model.parameters, f"parameters of {name}")
        require(self.arrival_noise, model.states, f"states of {name}")
        require(self.bounds, self._names, f"what the horizon of {name} estimates")
        for constant, movement in self.constants.items():
            if not movement > 0.0:
                raise ValueError(f"{constant} moves by {movement}, expected above 0")
        for bounded, (lower, upper) in self.bounds.items():
            if not lower < upper:
                raise ValueError(f"{bounded}: bounds are {lower} and {upper}, expected lower first")

    def start(self, measurement: np.ndarray) -> Estimate:
        begun = self.kalman.start(measurement)
        return self._told(self._anew(*begun.memory), {})

    def update(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Estimate:
        begun, failed = perf_counter(), False
        try:
            step = self._stepped(last.memory, self._news(command, measurement), begun)
            failed = self._astray(step.window)
        except (LostError, OutsideError, np.linalg.LinAlgError):
            failed = True
        late = perf_counter() - begun > self.deadline_s
        notes = {"fallback": float(failed or late), "late": float(late)}
        if not failed:
            notes |= {"step": step.length, "bounded": float(step.bounded), "nis": step.nis}
        if not (failed or late):
            return self._told(step.window, notes)
        memory = last.memory.X, last.memory.P
        found = self.kalman.update(replace(last, memory=memory), command, measurement)
        X, P = (np.asarray(part, dtype=float) for part in found.memory)
        again = self._anew(np.clip(X.ravel(), *self._limits), P)
        if failed:
            return self._told(again, notes)
        return replace(self._told(again, notes), memory=replace(again, tape=step.window.tape))

    @cached_property
    def kalman(self) -> ExtendedKalman:
        """The filter that starts the window and takes over; to it constants are random walks."""
        per_s = self.sample_time_s**-0.5
        walks = {name: movement * per_s for name, movement in self.constants.items()}
        unknown = {**self.unknown_inputs, **walks}
        return ExtendedKalman(**self.assumed | {"unknown_inputs": unknown})

    @cached_property
    def functions(self) -> Horizon:
        """The functions of the window."""
        found, arrival = self.kalman.filter, np.zeros(len(self._names))
        for k, (name, size) in enumerate(zip(self._names, found.scale, strict=True)):
            arrival[k] = (self.arrival_noise.get(name, 0.0) / size) ** 2 * self.sample_time_s
        return Horizon(
            found=found,
            constants=len(self.constants),
            nodes=self.horizon,
            arrival=arrival,
            loss=self.loss,
            coarsest_s=self.coarsest_s,
        )

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return (*self.plant.model.states, *self.unknown_inputs, *self.constants)

    @cached_property
    def _limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bound of X, infinite where there is none."""
        ends = [self.bounds.get(name, (-inf, inf)) for name in self._names]
        lower, upper = (np.array(ends).T - self._zero) / self._units
        return lower, upper

    @cached_property
    def _noise(self) -> np.ndarray:
        return np.array([self.measurement_noise[name] for name in self.plant.measured])

    def _news(self, command: np.ndarray, measurement: np.ndarray) -> np.ndarray:
        received = np.isfinite(measurement)
        return np.concatenate(
            [command, np.where(received, measurement, 0.0) / self._noise, received]
        )

    def _astray(self, window: Window) -> bool:
        """Whether the newest sample is further off than Gaussian noise and a free state leave it.

        A step through an impact can lower the cost and miss what the impact did to the path.  What
        is constant over the window may have to leave an error, and so may a loss that lets go.
        """
        if self.constants or not isinstance(self.loss, Squared):
            return False
        y, expected, there = (
            self.functions.part(window.tape, name)[:, -1] for name in ("y", "expected", "received")
        )
        return bool((there * np.abs(y - expected) > FAR).any())

    def _anew(self, X: np.ndarray, P: np.ndarray) -> Window:
        """A window that starts from what is known now."""
        return Window(self.functions.begun(X, P), X, P)

    def _stepped(self, window: Window, news: np.ndarray, begun: float) -> Step:
        """The window one sample later, after as many steps as there are passes and time."""
        d, p = self._given
        tape, told = self.functions.sample(window.tape, news, d, p)
        step = self._accepted(tape, told[1:], told[0])
        if step is None:
            failed = not told[1] <= allowed(told[0])
            step = self._searched(self.functions.move(window.tape, news, d, p)[0], failed)
        for _ in range(self.passes - 1):
            if perf_counter() - begun > self.deadline_s:
                break
            step = self._searched(step.window.tape)
        return step

    def _accepted(self, tape: np.ndarray, told: np.ndarray, before: float) -> Step | None:
        """The full step where it lowers the cost inside the bounds; else it is to be searched."""
        X = self.functions.part(tape, "points")[:, -1]
        if not told[0] <= allowed(before):  # true, too, where it is not finite
            return None
        if self.bounds and not ((self._limits[0] <= X) & (self._limits[1] >= X)).all():
            return None
        P = self._square(told[1 + len(X) : -1])
        return Step(Window(tape, X, P), 1.0, False, float(told[-1])) if sound(P) else None

    def _searched(self, tape: np.ndarray, full_failed: bool = False) -> Step:
        """The longest of the halved steps that lowers the cost, held inside the bounds.

        A full step that is known to fail is not tried again, unless bounds shorten it.

        Raises
        ------
        LostError
            If none does.
        """
        d, p = self._given
        functions, (lower, upper), n = self.functions, self._limits, len(self._names)
        aim, told = functions.solve(tape, np.zeros(n))
        before, newest, P = told[0], told[1 : n + 1], self._square(told[n + 1 : -1])
        if not (np.isfinite(told).all() and sound(P)):
            raise LostError("the linear problem is not finite, or its variances are below zero")
        at = functions.part(tape, "points")[:, -1]
        if ((at < lower) | (at > upper)).any():  # to come back inside may cost anything
            before = inf
        bounded = bool(((at + newest < lower) | (at + newest > upper)).any())
        if bounded:
            _, push = nearest_inside(newest, P, lower - at, upper - at)
            aim, _ = functions.solve(tape, push)
        first = 1 if full_failed and not bounded and np.isfinite(before) else 0
        for k in range(first, HALVINGS + 1):
            length = 0.5**k
            tried, after = functions.run(tape + length * (aim - tape), d, p)
            if after[0] <= allowed(before):
                X = np.clip(functions.part(tried, "points")[:, -1], lower, upper)
                return Step(Window(tried, X, P), length, bounded, float(told[-1]))
        raise LostError("no step lowers the cost")

    @cached_property
    def _given(self) -> tuple[np.ndarray, np.ndarray]:
        """Measured inputs and parameters, (n_d,) and (n_p,)."""
        _, d, p = self.plant.nominal
        return d.copy(), p.copy()

    def _square(self, P: np.ndarray) -> np.ndarray:
        return P.reshape(len(self._names), -1, order="F")

    def _told(self, window: Window, notes: Mapping[str, float]) -> Estimate:
        """What the newest X of a window says."""
        n = len(self.plant.model.states)
        values = (window.X * self._units + self._zero).tolist()
        told = dict(zip(self._notes, values[n:], strict=True))
        covariance = window.P[:n, :n] * self._areas
        state = np.array(values[:n])
        return Estimate(self.plant.model.states, state, covariance, window, told | dict(notes))

    @cached_property
    def _units(self) -> np.ndarray:
        return self.kalman.filter.scale

    @cached_property
    def _areas(self) -> np.ndarray:
        """Units of the covariance of the states."""
        n = len(self.plant.model.states)
        return np.outer(self._units[:n], self._units[:n])

    @cached_property
    def _zero(self) -> np.ndarray:
        """The values that X counts from: those of the parameters, else 0."""
        values = self.plant.values
        return np.array([values[n] if n in self.constants else 0.0 for n in self._names])

    @cached_property
    def _notes(self) -> tuple[str, ...]:
        """Names under which unknown inputs and constants stand in the notes."""
        unknown = (f"unknown {name}" for name in self.unknown_inputs)
        return (*unknown, *(f"estimated {name}" for name in self.constants))

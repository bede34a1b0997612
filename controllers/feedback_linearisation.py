"""Feedback linearisation of one axis: the valve is opened so that the jerk is the wanted one.

Position, speed and acceleration follow from the states; the third derivative of the position is the
first that the opening u acts on,

    y''' = L_f^3 y + what u adds = j(x, u)
    j(x, u) = r''' - k_2 (a - r'') - k_1 (v - r') - k_0 (y - r) - k_i integral

solved for u at every sample.  j comes from the plant's own expressions by automatic
differentiation; it grows with u, so u is found by bracketing.  Dry friction has no derivative: the
model for j does without, and the acceleration a counts the Coulomb force of the wanted direction.

A comparison for the scheduled designs: no modes, but the model enters with all its errors.

Source: A. Isidori, "Nonlinear Control Systems", 3rd ed., Ch. 4; the papers' future work.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from controllers.axis import Axis, axis_of
from controllers.motion import PREVIEW, MotionLimits, motion
from controllers.ranges import InRanges, ranges_of
from controllers.spec import ranged
from controllers.through_valve import ThroughValve, through_valve
from controllers.unseen import waiting
from linearize.modes import HybridModel
from linearize.reduction import DesignModel, design_model
from workbench.contracts import Command, Estimate
from workbench.effects.stribeck_friction import StribeckFriction
from workbench.plant import Plant

GRID = 17  # openings among which the wanted jerk is bracketed, twice


@dataclass(frozen=True, kw_only=True)
class LinearisingSpec:
    """All poles at -rate_per_s; the direction of friction is mixed as in a regulator."""

    rate_per_s: float = 100.0
    integral_share: float = 0.1
    sample_time_s: float = 1e-3
    turn_speed: float = 0.02
    turn_per_s: float = 20.0
    sliding_speed: float = 0.1
    smooth_v: float = 0.01
    limits: MotionLimits = field(default_factory=MotionLimits)


@dataclass(frozen=True, kw_only=True)
class AxisLinearisingSpec:
    """As :class:`LinearisingSpec`, in ranges of the axis: for any unit; ``sliding`` per second."""

    rate_per_s: float = 100.0
    integral_share: float = ranged(0.1)
    sample_time_s: float = 1e-3
    sliding: float = 0.5
    smooth_v: float = 0.01
    motion: InRanges = field(default_factory=InRanges)

    def of(self, wide: float) -> LinearisingSpec:
        """That of an axis whose range is so wide."""
        return LinearisingSpec(
            rate_per_s=self.rate_per_s,
            integral_share=self.integral_share,
            sample_time_s=self.sample_time_s,
            turn_speed=self.motion.turn * wide,
            turn_per_s=self.motion.turn_per_s,
            sliding_speed=self.sliding * wide,
            smooth_v=self.smooth_v,
            limits=self.motion.limits(wide),
        )


@dataclass(frozen=True, kw_only=True)
class FeedbackLinearising:
    """See the module.  Its memory is the integral, which rests while the valve is at a limit."""

    axis: Axis
    model: DesignModel
    frictionless: DesignModel
    spec: LinearisingSpec
    valve: ThroughValve
    preview: int = PREVIEW

    @property
    def sample_time_s(self) -> float:
        return self.spec.sample_time_s

    def start(self) -> Command:
        return Command(self.valve.shut, 0.0)

    @waiting
    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        spec, x = self.spec, estimate.pick(self.model.states)
        y, v = estimate.pick((self.axis.position, self.axis.velocity))
        wanted = motion(reference[0, :PREVIEW], spec.sample_time_s, spec.limits)
        error = float(y - reference[0, 0])
        way = np.tanh((wanted[0] - spec.turn_per_s * error) / spec.turn_speed)
        a = float(self.acceleration(x, way))
        integral = last.memory + spec.sample_time_s * error
        k = spec.rate_per_s ** np.array([3.0, 2.0, 1.0]) * [1.0, 3.0, 3.0]
        jerk = wanted[2] - k @ [error, v - wanted[0], a - wanted[1]]
        jerk -= spec.integral_share * spec.rate_per_s**4 * integral
        opening_v = self.opening_v(x, jerk)
        kept = last.memory if opening_v in self.valve.openings_v else integral
        notes = {"opening_v": opening_v, "integral": kept}
        return Command(self.valve.sent(opening_v, estimate), kept, notes)

    def opening_v(self, x: np.ndarray, jerk: float) -> float:
        """The opening whose jerk is this, within the valve's range."""
        low, high = self.valve.openings_v
        for _ in range(2):
            tried = np.linspace(low, high, GRID)
            found = self.jerks(x, self.valve.centre_v + tried).full().ravel()
            above = int(np.searchsorted(found, jerk))
            if above in (0, GRID):
                return float(tried[min(above, GRID - 1)])
            low, high = tried[above - 1], tried[above]
        between = (jerk - found[above - 1]) / (found[above] - found[above - 1])
        return float(low + between * (high - low))

    @cached_property
    def acceleration(self) -> ca.Function:
        """(x, way) -> acceleration by the pressures, less Coulomb friction against the way.

        The way is 1 forward and -1 backward; the force is what the model with friction has more
        than the one without, at a speed at which it slides.
        """
        x, way = ca.SX.sym("x", len(self.model.states)), ca.SX.sym("way")
        v = self.model.states.index(self.axis.velocity)

        def rate(model: DesignModel, at: ca.SX) -> ca.SX:
            return model.f(at, self.valve.centre_v)[0][v]

        value = rate(self.frictionless, x)
        for side in (1.0, -1.0):
            at = ca.vertcat(x[:v], side * self.spec.sliding_speed, x[v + 1 :])
            dry = rate(self.frictionless, at) - rate(self.model, at)
            value -= 0.5 * (1.0 + side * way) * dry
        return ca.Function("acceleration", [x, way], [value])

    @cached_property
    def jerks(self) -> ca.Function:
        """(x, openings (1, GRID)) -> third derivative of the position for each, (1, GRID)."""
        model = self.frictionless
        x, u = ca.SX.sym("x", len(model.states)), ca.SX.sym("u")
        rates = model.f(x, u)[0]
        acceleration = rates[model.states.index(self.axis.velocity)]
        jerk = ca.jacobian(acceleration, x) @ rates
        one = ca.Function("jerk", [x, u], [jerk])
        return one.map("jerks", "serial", GRID, [0], [])


def axis_linearising(
    hybrid: HybridModel, spec: AxisLinearisingSpec | None = None
) -> FeedbackLinearising:
    """The law of the plant of a hybrid model; of its modes it needs none."""
    ((_, wide),) = ranges_of(hybrid.plant)
    return feedback_linearising(hybrid.plant, (spec or AxisLinearisingSpec()).of(wide))


def feedback_linearising(plant: Plant, spec: LinearisingSpec | None = None) -> FeedbackLinearising:
    """The law of a plant with one valve and one axis.

    Raises
    ------
    ValueError
        If the plant is not of that kind.
    """
    spec = spec or LinearisingSpec()
    dry = {
        f"{e.name}.{strength}": 0.0
        for e in plant.effects
        if isinstance(e, StribeckFriction)
        for strength in ("coulomb_force_n", "stiction_excess_n")
    }
    return FeedbackLinearising(
        axis=axis_of(plant),
        model=design_model(plant),
        frictionless=design_model(plant.with_values(dry)),
        spec=spec,
        valve=through_valve(plant.lean(), spec.smooth_v),
    )

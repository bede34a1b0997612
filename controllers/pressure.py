"""Pressure of a vessel behind one valve: open as far as takes it to the reference in one sample.

    p[k+1](u) = r + (1 - share) (p[k] - r)

The sample under an opening is that of the design model, the active regime's flow with its bends;
p[k+1] grows with the command, so the command is bracketed, twice, as in
:mod:`controllers.feedback_linearisation`.  Far from the reference that is the open valve, near to
it a partial opening: a step ends as soon as the valve allows, and does not overshoot.

What the model has wrong stays as a steady error, and an integral takes it out; it rests while the
valve is fully open.

Source: one-step (deadbeat) control, K. J. Astrom and B. Wittenmark, "Computer-Controlled Systems",
3rd ed., Ch. 4.3.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from controllers.spec import ranged
from controllers.unseen import waiting
from linearize.modes import HybridModel
from linearize.reduction import DesignModel
from workbench.contracts import Command, Estimate

GRID = 33  # commands among which the wanted pressure is bracketed, twice
SUBSTEPS = 4  # of a sample


@dataclass(frozen=True, kw_only=True)
class PressureSpec:
    """Numbers of a pressure design.

    Attributes
    ----------
    share
        Of the distance that one sample is to take; 1 for all of it.
    integral_time_s
        In which a steady error is taken out.
    largest_pa
        An error that counts for the integral: beyond, the step itself is the error.
    """

    sample_time_s: float = 2.5e-3
    share: float = ranged(0.8, most=1.0, above=True)
    integral_time_s: float = 0.05
    largest_pa: float = 2e4


@dataclass(frozen=True)
class PressureControl:
    """See the module.  Its memory is the integral, in Pa that are asked for on top."""

    model: DesignModel
    spec: PressureSpec
    limits: tuple[float, float]
    centre: float
    preview: int = field(default=1)

    @property
    def sample_time_s(self) -> float:
        return self.spec.sample_time_s

    def start(self) -> Command:
        return Command(np.array([self.centre]), 0.0)

    @waiting
    def step(self, last: Command, reference: np.ndarray, estimate: Estimate) -> Command:
        spec, x = self.spec, estimate.pick(self.model.states)
        error_pa = float(reference[0, 0] - x[0])
        integral_pa = last.memory
        if abs(error_pa) < spec.largest_pa:
            integral_pa += spec.sample_time_s / spec.integral_time_s * error_pa
        wanted_pa = float(x[0]) + spec.share * error_pa + integral_pa
        command = self.command(x, wanted_pa)
        kept = last.memory if command in self.limits else integral_pa
        return Command(np.array([command]), kept, {"integral_pa": kept})

    def command(self, x: np.ndarray, wanted_pa: float) -> float:
        """The command whose sample ends at this pressure, within the valve's range."""
        low, high = self.limits
        for _ in range(2):
            tried = np.linspace(low, high, GRID)
            found = self.later_pa(x, tried).full().ravel()
            above = int(np.searchsorted(found, wanted_pa))
            if above in (0, GRID):
                return float(tried[min(above, GRID - 1)])
            low, high = tried[above - 1], tried[above]
        between = (wanted_pa - found[above - 1]) / (found[above] - found[above - 1])
        return float(low + between * (high - low))

    @cached_property
    def later_pa(self) -> ca.Function:
        """(x, commands (1, GRID)) -> pressure a sample later under each, (1, GRID)."""
        x, u = ca.SX.sym("x", len(self.model.states)), ca.SX.sym("u")
        later, h = x, self.spec.sample_time_s / SUBSTEPS
        for _ in range(SUBSTEPS):
            half = later + 0.5 * h * self.model.f(later, u)[0]
            later = later + h * self.model.f(half, u)[0]
        one = ca.Function("later", [x, u], [later[0]])
        return one.map("later", "serial", GRID, [0], [])


def pressure_control(hybrid: HybridModel, spec: PressureSpec | None = None) -> PressureControl:
    """The design for the vessel of a hybrid model; its modes say what it can reach, see there."""
    (signal,) = hybrid.plant.commands
    limits = (float(signal.lower), float(signal.upper))
    centre = float(signal.nominal)
    return PressureControl(hybrid.model, spec or PressureSpec(), limits, centre)

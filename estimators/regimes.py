"""What a plant may do at one time, as plants of their own: sticks or slides, a valve open or shut.

A regime is the plant itself on fewer states, with some of them held or with a command put in place
of what is sent.  All regimes of a plant have the same states, so that estimates can be mixed.

What sticks has its velocity decay within a fraction of a sample, and its position stays.  What
slides does so in one direction, with the friction of sliding down to rest: a friction law that goes
through zero at rest would stick by itself, and neither regime would be more likely.  A bristle
and the dynamics of a valve are left out, by :class:`linearize.reduction.DesignModel`: what they do
within milliseconds is what the switch between regimes stands for.  Left in, each regime could
follow the other one.

Source: Karnopp 1985 (zero velocity as a mode of its own); physics.md 4.2 and 4.3.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import product
from typing import Any

import casadi as ca
import numpy as np

from linearize.axes import drive_axis, joint_axes, rig_axis
from linearize.axis import Travel
from linearize.reduction import DesignModel, closed_command, design_model
from linearize.shift_modes import ShiftPoints, valve_cut
from workbench.effect import State
from workbench.effects.solenoid_valve import SolenoidValve
from workbench.effects.valve_command import DeadZone
from workbench.model import Model
from workbench.plant import Plant

STANDS_S = 1e-4  # in which what is held comes to rest
FASTER = 5.0  # times the speed of rest: there friction is that of sliding


@dataclass(frozen=True, kw_only=True)
class Regime(Plant):
    """A plant in one regime; see the module.

    Attributes
    ----------
    design
        The plant on the states that are kept.
    held
        Positions and their velocities that stand still.
    sliding
        Least speed that friction sees of a velocity, with the sign of its direction.
    sent
        Commands as they are in it, whatever is sent.
    """

    design: DesignModel
    held: tuple[tuple[str, str], ...] = ()
    sliding: Mapping[str, float] = field(default_factory=dict)
    sent: Mapping[str, float] = field(default_factory=dict)

    @property
    def state_list(self) -> dict[str, State]:
        """The states that are kept."""
        known = self.design.plant.state_list
        return {name: known[name] for name in self.design.states}

    @cached_property
    def model(self) -> Model:
        """The reduced model, with what is held at rest and what is sent."""
        base = self.design.plant.model
        x, u = self.design.symbols
        sent = [self.sent.get(name, u[k]) for k, name in enumerate(base.commands)]
        plain = ca.Function("plain", [x, u], self.design.expressions)
        rates, outputs = plain(x, ca.vertcat(ca.SX(0, 1), *sent))
        names = self.design.states
        for velocity, least in self.sliding.items():
            k = names.index(velocity)
            faster = ca.fmax(x[k], least) if least > 0.0 else ca.fmin(x[k], least)
            rates[k] = ca.substitute(rates[k], x[k], faster)
        for position, velocity in self.held:
            rates[names.index(position)] = 0.0
            rates[names.index(velocity)] = -x[names.index(velocity)] / STANDS_S
        kept = [base.states.index(name) for name in names]
        return replace(
            base,
            states=names,
            symbols=(x, u, *base.symbols[2:]),
            rates=rates,
            outputs=outputs,
            tolerances=base.tolerances[kept],
            _steps={},
            _compiled={},
            _blocks={},
        )


def regimes(plant: Plant) -> dict[str, Regime]:
    """The regimes of a plant by label; one, named after the plant, where none are known."""
    lean = plant.lean()
    of = REGIMES.get(plant.name, _one)
    return dict(of(lean))


def _regime(design: DesignModel, **what: Any) -> Regime:
    own = {f.name: getattr(design.plant, f.name) for f in fields(Plant)}
    return Regime(**own, design=design, **what)


def _one(plant: Plant) -> Iterator[tuple[str, Regime]]:
    yield plant.name, _regime(DesignModel(plant, plant.model.states, ()))


def _by_travel(travels: Callable[[Plant], tuple[Travel, ...]]) -> Callable:
    """Each of what moves slides down, sticks or slides up, by itself."""

    def of(plant: Plant) -> Iterator[tuple[str, Regime]]:
        design = _without_bristle(plant)
        several = travels(plant)
        for cuts in product(*(each.friction_cut() for each in several)):
            held, sliding = [], {}
            for each, interval in zip(several, cuts, strict=True):
                if interval.holds:
                    held.append((each.position, each.velocity))
                else:
                    sliding[each.velocity] = np.sign(interval.point) * FASTER * each.resting
            label = " ".join(interval.label for interval in cuts)
            yield label, _regime(design, held=tuple(held), sliding=sliding)

    return of


def _without_bristle(plant: Plant) -> DesignModel:
    """The design model with its gas masses and behind its dead zone, as commands are sent."""
    design = design_model(plant)
    widths = {
        f"{e.name}.half_width_v": e.half_width_v for e in plant.effects if isinstance(e, DeadZone)
    }
    masses = {name for name in plant.model.states if name.endswith(".mass_kg")}
    kept = tuple(n for n in plant.model.states if n in masses or n in design.states)
    return replace(design, plant=design.plant.with_values(widths), states=kept)


def _gearbox(plant: Plant) -> Iterator[tuple[str, Regime]]:
    """Each valve vents or charges, by itself: the armatures stand where that leaves them."""
    valves = [f"{e.name}." for e in plant.effects if isinstance(e, SolenoidValve)]
    kept = tuple(n for n in plant.model.states if not n.startswith(tuple(valves)))
    design, cut = DesignModel(plant, kept, ()), valve_cut(ShiftPoints())
    for levels in product(*cut.values()):
        sent = {name: level.point for name, level in zip(cut, levels, strict=True)}
        yield " ".join(level.label for level in levels), _regime(design, sent=sent)


def _valve_follows(plant: Plant) -> Iterator[tuple[str, Regime]]:
    """The spool follows its command, or stays shut."""
    design = DesignModel(plant, plant.model.states, ())
    yield "follows", _regime(design)
    (command,) = plant.model.commands
    yield "stays shut", _regime(design, sent={command: closed_command(plant, command)})


REGIMES: dict[str, Callable[[Plant], Iterator[tuple[str, Regime]]]] = {
    "servo_drive": _by_travel(lambda plant: (drive_axis(plant),)),
    "crr_rig": _by_travel(lambda plant: (rig_axis(plant),)),
    "crr_arm": _by_travel(joint_axes),
    "crr_leg": _by_travel(joint_axes),
    "gearbox": _gearbox,
    "soft_joint": _valve_follows,
}

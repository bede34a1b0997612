"""What a plant may do at one time, as plants of their own: sticks or slides, a valve open or shut.

A regime is the plant itself on fewer states, with some of them held or with a command put in place
of what is sent.  All regimes of a plant have the same states, so that estimates can be mixed.

What sticks has its velocity decay within a fraction of a sample, and its position stays; on a
bristle it swings, and the bristle never yields.  What slides does so in one direction, with the
friction of sliding down to rest: a friction law that goes through zero at rest would stick by
itself, and neither regime would be more likely.  Its bristle is bent as far as sliding bends it,
from where it springs back when the slide sticks.  The dynamics of a valve are left out, by
:class:`linearize.reduction.DesignModel`: what they do within milliseconds is what the switch
between regimes stands for.  Left in, each regime could follow the other one.

Source: Karnopp 1985 (zero velocity as a mode of its own); Dupont et al. 2002, "Single state
elastoplastic friction models" (presliding without loss: alpha = 0); physics.md 4.2 and 4.3.
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
from workbench.effects.bristle_friction import BristleFriction, LuGre
from workbench.effects.solenoid_valve import SolenoidValve
from workbench.effects.valve_command import DeadZone
from workbench.model import Model
from workbench.plant import Plant

STANDS_S = 1e-4  # in which what is held comes to rest, and a bristle is bent
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
    bent
        (deflection, velocity, speed) of bristles: each sees that speed in place of the velocity.
    sent
        Commands as they are in it, whatever is sent.
    """

    design: DesignModel
    held: tuple[tuple[str, str], ...] = ()
    sliding: Mapping[str, float] = field(default_factory=dict)
    bent: tuple[tuple[str, str, float], ...] = ()
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
        for deflection, velocity, speed in self.bent:
            k = names.index(deflection)
            rates[k] = ca.substitute(rates[k], x[names.index(velocity)], speed)
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
        design = _as_sent(plant)
        several = travels(plant)
        bristles = {each.velocity: _bristle(plant, each.velocity) for each in several}
        for cuts in product(*(each.friction_cut() for each in several)):
            held, sliding, bent, plastic = [], {}, [], {}
            for each, interval in zip(several, cuts, strict=True):
                bristle, way = bristles[each.velocity], float(np.sign(interval.point))
                if way:
                    sliding[each.velocity] = way * FASTER * each.resting
                if bristle and way:
                    speed = way * float(bristle.breakaway_deflection_m) / STANDS_S
                    bent.append((f"{bristle.name}.deflection_m", each.velocity, speed))
                    plastic[bristle.name] = dict(plasticity=LuGre(), presliding_share=0.0)
                elif bristle:
                    plastic[bristle.name] = dict(plasticity=Elastic())
                elif not way:
                    held.append((each.position, each.velocity))
            label = " ".join(interval.label for interval in cuts)
            what = dict(held=tuple(held), sliding=sliding, bent=tuple(bent))
            yield label, _regime(_with_bristles(design, plastic), **what)

    return of


class Elastic:
    """A bristle that never yields: alpha = 0."""

    def __call__(self, deflection: Any, velocity: Any, limit: Any) -> float:
        return 0.0


def _bristle(plant: Plant, velocity: str) -> BristleFriction | None:
    """The bristle that what moves with this velocity bends, if any."""
    model = plant.model
    for each in (m for m in plant.members if isinstance(m, BristleFriction)):
        k = model.states.index(f"{each.name}.deflection_m")
        if ca.depends_on(model.rates[k], model.symbols[0][model.states.index(velocity)]):
            return each
    return None


def _with_bristles(design: DesignModel, plastic: Mapping[str, Mapping[str, Any]]) -> DesignModel:
    """The design with friction of other plasticity, by name, and other shares of the bristle."""
    effects = tuple(replace(e, **plastic.get(e.name, {})) for e in design.plant.effects)
    return replace(design, plant=replace(design.plant, effects=effects))


def _as_sent(plant: Plant) -> DesignModel:
    """The design model with its gas masses and bristles, behind its dead zone: as commands are."""
    design = design_model(plant)
    values = {
        f"{e.name}.half_width_v": e.half_width_v for e in plant.effects if isinstance(e, DeadZone)
    } | {
        f"{e.name}.presliding_share": e.presliding_share
        for e in plant.effects
        if isinstance(e, BristleFriction)
    }
    ends = (".mass_kg", ".deflection_m")
    kept = tuple(n for n in plant.model.states if n.endswith(ends) or n in design.states)
    return replace(design, plant=design.plant.with_values(values), states=kept)


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

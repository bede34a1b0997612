"""What a design model leaves out of its plant, and why: a written list, and the model itself.

A controller is designed on fewer states than the plant has, because some of them are too fast to
be controlled (a bristle at -2e4 1/s), change the force too little to be worth a gain (gas masses)
or can be undone in the command (the dead zone).  Each is one :class:`LeftOut`, so the reduction
can be printed, and undone one line at a time.

Source: paper 003, Sec. V.A, which lists what it leaves out; physics.md 1.2 (level 3) and 4.3.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import casadi as ca
import numpy as np

from linearize.coupling import RigidCoupling, coupled_rates, with_reactions
from workbench.effect import Expression
from workbench.effects.bristle_friction import BristleFriction
from workbench.effects.sensor_response import SensorLag
from workbench.effects.solenoid_valve import SolenoidValve
from workbench.effects.supply_droop import SupplyDroop
from workbench.effects.timing import Timing
from workbench.effects.valve_command import DeadZone, ValveLag, ValveOffset
from workbench.effects.valve_hysteresis import ValveHysteresis
from workbench.effects.wall_heat import HeatedWall
from workbench.floating_piston import ControlChamber
from workbench.plant import Plant

FLOW_KG_S = 1e-2  # typical size of a flow that is a command
# Effects whose states a design does without.
INSIDE = (BristleFriction, HeatedWall, SensorLag, SupplyDroop, ValveHysteresis, ValveLag)


@dataclass(frozen=True)
class LeftOut:
    """One thing a design model does without: what, what takes its place, and the reason."""

    what: str
    instead: str
    reason: str


@dataclass(frozen=True)
class DesignModel:
    """A plant with fewer states: x full = full(x), dx/dt and y = f(x, u).

    Attributes
    ----------
    plant
        The lean plant with the commands of the design: the dead zone and the bristle at null, or
        flows in place of valves.
    states
        Names of the states that are kept, in order.
    left_out
        What is not in it.
    nulls
        Values that differ from the plant's, by ``part.parameter_unit``.
    couplings
        Parts that move with a body, and bring no states.
    pushes
        For each velocity of bodies that feel each other's inertia, a state that pushes on it alone.
    held
        Velocities among those that something holds at zero.
    """

    plant: Plant
    states: tuple[str, ...]
    left_out: tuple[LeftOut, ...]
    nulls: Mapping[str, float] = field(default_factory=dict)
    couplings: tuple[RigidCoupling, ...] = ()
    pushes: Mapping[str, str] = field(default_factory=dict)
    held: tuple[str, ...] = ()

    def holding(self, states: Iterable[str]) -> DesignModel:
        """The same model with the velocities among these states held, where others feel that."""
        held = tuple(name for name in states if name in self.pushes)
        if held not in self._held:
            self._held[held] = replace(self, held=held)
        return self._held[held]

    @cached_property
    def _held(self) -> dict[tuple[str, ...], DesignModel]:
        """Models that were made by :meth:`holding`, with their derivatives; at first this one."""
        return {self.held: self}

    @property
    def commands(self) -> tuple[str, ...]:
        return self.plant.model.commands

    @property
    def measured(self) -> tuple[str, ...]:
        return self.plant.measured

    @cached_property
    def scale(self) -> np.ndarray:
        """Typical size of each state, shape (n_x,)."""
        sizes = {name: state.scale for name, state in self.plant.state_list.items()}
        return np.array([sizes[name] for name in self.states])

    @cached_property
    def command_scale(self) -> np.ndarray:
        """Typical size of each command, shape (n_u,): a tenth of its range, of a flow 10 g/s."""
        ranges = [signal.upper - signal.lower for signal in self.plant.commands]
        return np.array([0.1 * wide if np.isfinite(wide) else FLOW_KG_S for wide in ranges])

    @cached_property
    def initial(self) -> np.ndarray:
        """Initial value of the kept states, shape (n_x,)."""
        values = dict(zip(self.plant.model.states, self.plant.initial, strict=True))
        return np.array([values[name] for name in self.states])

    @cached_property
    def f(self) -> ca.Function:
        """(x, u) -> (dx/dt, y), x the kept states."""
        return ca.Function("design", [*self.symbols], [*self.expressions])

    @cached_property
    def jacobians(self) -> ca.Function:
        """(x, u) -> (A, B, C, D)."""
        blocks = [ca.jacobian(e, s) for e in self.expressions for s in self.symbols]
        return ca.Function("jacobians", [*self.symbols], blocks)

    @cached_property
    def full(self) -> ca.Function:
        """Kept states -> state of the plant, switched valves as the nominal command leaves them."""
        x, u = self.symbols
        whole = ca.substitute(self._substituted[0], u, ca.DM(self.plant.nominal[0]))
        return ca.Function("full", [x], [whole])

    @cached_property
    def full_under(self) -> ca.Function:
        """(x, u) -> state of the plant, where the command has stood for long."""
        return ca.Function("full_under", [*self.symbols], [self._substituted[0]])

    def quantities(self, *names: str) -> ca.Function:
        """(x, u) -> the named quantities of the reduced plant, shape (n, 1)."""
        read = [ca.SX(self.plant.model.conditions.read(name)) for name in names]
        values = self.reduced([ca.vertcat(*read)])
        return ca.Function("quantities", [*self.symbols], values)

    @property
    def symbols(self) -> tuple[ca.SX, ca.SX]:
        """The column vectors x of the kept states, and u."""
        x, u = self.plant.model.symbols[:2]
        kept = [x[self.plant.model.states.index(name)] for name in self.states]
        return ca.vertcat(*kept), u

    @cached_property
    def _substituted(self) -> tuple[ca.SX, ca.SX, ca.SX]:
        """State, rates and outputs of the plant in terms of the kept states and numbers."""
        model = self.plant.model
        rates = coupled_rates(model, self.couplings)
        return tuple(self.reduced([model.symbols[0], rates, model.outputs]))

    def reduced(self, expressions: list[ca.SX]) -> list[ca.SX]:
        """Expressions of the plant in terms of the kept states, the commands and numbers."""
        model = self.plant.model
        x, _, d, p = model.symbols
        _, d_nominal, _ = self.plant.nominal
        values = {**self.plant.values, **self.nulls}
        follows = {}
        for each in self.couplings:
            follows |= each.stand_ins(model.conditions)
        inside = [name for name in model.states if name not in self.states]
        stand_ins = [follows.get(n, _stand_in(self.plant, n)) for n in inside]
        old = ca.vertcat(*(x[model.states.index(name)] for name in inside), ca.SX(0, 1))
        new = ca.vertcat(*stand_ins, ca.SX(0, 1))
        for _ in range(2):  # what stands in for a lag may hold the play before it
            expressions = ca.substitute(expressions, [old], [new])
        numbers = [ca.DM(d_nominal), ca.DM(list(values.values()))]
        return ca.substitute(expressions, [d, p], numbers)

    @cached_property
    def expressions(self) -> tuple[ca.SX, ca.SX]:
        _, rates, outputs = self._substituted
        own = rates[[self.plant.model.states.index(name) for name in self.states]]
        rows = {
            name: (self.states.index(name), self.states.index(push))
            for name, push in self.pushes.items()
        }
        return with_reactions(self.symbols[0], own, rows, self.held), outputs


def design_model(plant: Plant) -> DesignModel:
    """The plant without gas masses, bristle, dead zone and droop of the supply."""
    lean = plant.lean()
    nulls = {f"{m.name}.half_width_v": 0.0 for m in lean.effects if isinstance(m, DeadZone)} | {
        f"{m.name}.presliding_share": 0.0 for m in lean.effects if isinstance(m, BristleFriction)
    }
    design = lean.with_values(nulls)
    kept = tuple(name for name in design.model.states if not _passed_over(design, name))
    return DesignModel(design, kept, tuple(_left_out(lean)))


def closed_command(plant: Plant, name: str | None = None) -> float:
    """Value of a command, the first unless named, at which its valve stands at its centre.

    That is the centre of the valve itself, the nominal command where it has none, and the offset,
    which some valves hold themselves.
    """
    signal = next(s for s in plant.commands if name in (None, s.name))
    valve = next((e for e in plant.effects if e.name == signal.name.partition(".")[0]), None)
    centre = getattr(valve, "centre_v", signal.nominal) + getattr(valve, "offset_share", 0.0)
    return float(centre) + offset(plant, signal.name)


def offset(plant: Plant, name: str) -> float:
    """By how much a command's valve stands off its centre."""
    offsets = (e for e in plant.effects if isinstance(e, ValveOffset) and e.signal == name)
    return sum(float(effect.offset_v) for effect in offsets)


def _passed_over(plant: Plant, state: str) -> bool:
    member, _, quantity = state.rpartition(".")
    owner = next((m for m in plant.members if m.name == member), None)
    return owner is not None and (quantity == "mass_kg" or isinstance(owner, INSIDE))


def _stand_in(plant: Plant, state: str) -> Expression:
    """What takes the place of a state that is left out.

    Gas at supply temperature, or that of the room where nothing supplies it, a control chamber at
    ambient pressure, an armature where its command drives it; no lag, bristle, droop or warmth.
    """
    member, _, quantity = state.rpartition(".")
    now = plant.model.conditions
    owner = plant.member(member)
    if quantity == "mass_kg":
        gas, room_k = now[member], now[_source(plant)].temperature_k
        return gas.pressure_pa * gas.volume_m3 / (gas.gas_constant_j_kg_k * room_k)
    if quantity == "lagged_v":
        return now[member].entering_v
    if quantity == "left_share":
        return now[member].entering_share
    if isinstance(owner, SensorLag):
        return now.read(owner.signal) / owner.unit
    if isinstance(owner, SolenoidValve):
        return now[member].command * owner.driven()[quantity]
    if isinstance(owner, ControlChamber):
        return now["atmosphere"].pressure_pa
    return ca.SX(0.0)


def _source(plant: Plant) -> str:
    """Where the gas comes from."""
    return "supply" if "supply" in plant.model.conditions else "atmosphere"


def _left_out(plant: Plant) -> Iterator[LeftOut]:
    for name in plant.model.states:
        if name.endswith(".mass_kg"):
            room = f"gas at {_source(plant)} temperature (level 3 of physics.md 1.2)"
            yield LeftOut(name, room, "temperature moves the flow by a few per cent only")
    for member in plant.effects:
        if isinstance(member, DeadZone):
            band = "undone in the command"
            yield LeftOut(member.name, band, "a band without slope has no linear model")
        elif isinstance(member, BristleFriction):
            steady = "its steady value for the direction of sliding, constant in the drift"
            yield LeftOut(f"{member.name} bristle", steady, "a pole near -2e4 1/s ruins a design")
        elif isinstance(member, SupplyDroop):
            yield LeftOut(
                member.name, "supply at its nominal pressure", "slow and outside the loop"
            )
        elif isinstance(member, ValveLag):
            yield LeftOut(
                member.name, "no lag", "no law reads the spool; margins have its lag in the loop"
            )
        elif isinstance(member, HeatedWall):
            yield LeftOut(f"{member.name} warmth", "wall as it was", "minutes beside the gas")
        elif isinstance(member, ValveHysteresis):
            yield LeftOut(member.name, "no play", "a play has no linear model")
        elif isinstance(member, SensorLag):
            yield LeftOut(member.name, "no lag", "estimators know it, or margins hold it")
        elif isinstance(member, Timing):
            yield LeftOut(member.name, "no delay", "acts on samples; the margins must hold it")

"""The gearbox actuator as paper 003, Sec. V, reduces it: 18 states to 4, by a written list.

State (p1, p2, x, v).  Two kinds of input: the two mass flows, as in the paper, or the two valves,
whose commands then choose the mode.  The plant is the one of the simulation; what is left out of it
is a null value, a stand-in for a state, or a rigid coupling, one :class:`LeftOut` each.

Source: paper 003 Sec. V.A; physics.md 4.2.  E003-8 and E003-9 (mass and force by side) follow from
the coupling of the floating piston.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from linearize.coupling import couplings
from linearize.reduction import DesignModel, LeftOut
from workbench.effect import Effect
from workbench.effects.detent import Detent
from workbench.effects.solenoid_valve import SolenoidValve
from workbench.effects.stribeck_friction import StribeckFriction
from workbench.effects.timing import Timing
from workbench.effects.wall_heat import ConstantWallHeat
from workbench.plant import Plant, Signal
from workbench.plants.gearbox import FLOATING, MAIN
from workbench.sources import FlowSource

POSITION, VELOCITY = f"{MAIN}.position_m", f"{MAIN}.velocity_m_s"
PRESSURES = ("chamber_1.pressure_pa", "chamber_2.pressure_pa")
STATES = (*PRESSURES, POSITION, VELOCITY)
MASSES = ("chamber_1.mass_kg", "chamber_2.mass_kg")
INSIDE_M = 1e-6  # beside Neutral or a stop: on one side of it
FLOWS = ("valve_1.flow_kg_s", "valve_2.flow_kg_s")


@dataclass(frozen=True)
class Omission:
    """Effects of one kind that the reduction sets to null; keep one by not passing it."""

    kind: type[Effect]
    strengths: tuple[str, ...]
    left_out: LeftOut

    def nulls(self, plant: Plant) -> Iterator[tuple[str, float]]:
        """Name and null of every strength that it takes."""
        for effect in plant.effects:
            if isinstance(effect, self.kind):
                for strength in self.strengths:
                    yield f"{effect.name}.{strength}", effect.parameters()[strength].null


COULOMB = Omission(
    StribeckFriction,
    ("coulomb_force_n", "stiction_excess_n", "pressure_factor_n_pa"),
    LeftOut("dry friction", "viscous part only", "a constant of the direction, without slope"),
)
DETENT = Omission(
    Detent,
    ("force_n",),
    LeftOut("detent", "none", "180 N at the piston beside some 1600 N of pressure"),
)
HEAT = Omission(
    ConstantWallHeat,
    ("coefficient_w_m2_k",),
    LeftOut("wall heat", "none", "a shift is over in 20 ms"),
)
OMITTED = (COULOMB, DETENT, HEAT)
RIGID = (
    LeftOut(
        FLOATING,
        "at rest while x <= 0, one body with the main piston above",
        "contact of 2e7 N/m is no part of a design",
    ),
    LeftOut("finger", "one body with the main piston", "a joint of 5e6 N/m is no part of a design"),
    LeftOut("control_chamber.pressure_pa", "ambient pressure", "its port is wide"),
)
GAS = LeftOut(
    "mass of gas", "gas at supply temperature", "temperature moves a braking pressure by per cents"
)
SWITCHED = LeftOut("solenoids", "armature at the end its command drives it to", "over in 4 to 7 ms")
REPLACED = LeftOut("solenoids", "their mass flows as commands", "the input of the paper")


def fed_by_flows(plant: Plant) -> Plant:
    """The same plant with the flow into each chamber as a command in place of its solenoid valve.

    Nothing else changes: it is what a reduced model under the same flows is compared with.
    """
    valves = [effect for effect in plant.effects if isinstance(effect, SolenoidValve)]
    sources = tuple(FlowSource(name=valve.name, chamber=valve.chamber) for valve in valves)
    gone = {valve.name for valve in valves}
    switched = {f"{name}.command" for name in gone}
    kept = [e for e in plant.effects if e.name not in gone]
    return replace(
        plant,
        parts=(*plant.parts, *sources),
        effects=tuple(e for e in kept if getattr(e, "signal", None) not in switched),
        commands=tuple(Signal(f"{source.name}.flow_kg_s", nominal=0.0) for source in sources),
    )


def shift_model(plant: Plant, omitted: tuple[Omission, ...] = OMITTED) -> DesignModel:
    """The gearbox on (p1, p2, x, v), with the two mass flows as commands.

    Without ``COULOMB`` among what is omitted, dry friction stays: at a point that slides it is a
    constant of the drift, with the sign of the direction.
    """
    return _reduced(fed_by_flows(plant.lean()), (REPLACED, *_late(plant)), omitted)


def switched_shift_model(plant: Plant, omitted: tuple[Omission, ...] = OMITTED) -> DesignModel:
    """The gearbox on (p1, p2, x, v), with the commands of the valves, each 0 or 1."""
    return _reduced(plant.lean(), (SWITCHED, *_late(plant)), omitted)


def driving_model(plant: Plant) -> DesignModel:
    """The gearbox on (p1, p2, m1, m2, x, v), with the two mass flows as commands.

    For longer than a shift: dry friction and detent hold the piston between shifts, and gas that
    expands through a valve cools by some 80 K.
    """
    whole = _reduced(fed_by_flows(plant.lean()), (REPLACED, *_late(plant)), ())
    left_out = tuple(item for item in whole.left_out if item is not GAS)
    return replace(whole, states=(*PRESSURES, *MASSES, POSITION, VELOCITY), left_out=left_out)


def carried_share(model: DesignModel) -> float:
    """Share of its speed that the main piston keeps as it picks the floating one up at Neutral.

    The impact is plastic, m_L v = m_H v+.  The ratio of the moving masses is that of the model: it
    shows in what the pressure of chamber 1 does on either side, A1/m.
    """
    return _push(model, INSIDE_M) / _push(model, -INSIDE_M)


def _push(model: DesignModel, place_m: float) -> float:
    """Acceleration by the pressure of chamber 1, at rest at a place, m/s2 per Pa."""
    x = model.initial.copy()
    x[model.states.index(POSITION)] = place_m
    row, column = model.states.index(VELOCITY), model.states.index(PRESSURES[0])
    return float(model.jacobians(x, [0.0, 0.0])[0][row, column])


def _reduced(
    plant: Plant, valves: tuple[LeftOut, ...], omitted: tuple[Omission, ...]
) -> DesignModel:
    return DesignModel(
        plant=plant,
        states=STATES,
        left_out=(*valves, *RIGID, GAS, *(each.left_out for each in omitted), *_slow(plant)),
        nulls=dict(pair for each in omitted for pair in each.nulls(plant)),
        couplings=tuple(couplings(plant)),
    )


def _slow(plant: Plant) -> Iterator[LeftOut]:
    """What a user's plant has besides: each effect whose own state the reduction holds at zero."""
    for effect in plant.effects:
        if [*effect.states()] and not isinstance(effect, SolenoidValve):
            yield LeftOut(effect.name, "without its own state", "no part of a shift of 20 ms")


def _late(plant: Plant) -> Iterator[LeftOut]:
    """Delays of a user's plant, which go with the valves whose commands they delay."""
    for effect in plant.effects:
        if isinstance(effect, Timing) and not effect.absent:
            yield LeftOut(effect.name, "no delay", "acts on samples; the filter looks ahead by it")

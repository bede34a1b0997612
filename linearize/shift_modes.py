"""The modes of the gearbox actuator: two sides, two valves, and Neutral held from both sides.

Paper 003, Sec. V, has 2 x 2 x 2 = 8.  The ninth, "held at Neutral", is where the main piston rests
against the floating one: pressure drives it up from below Neutral and down from above.  Without it
there is no Neutral at all.

Source: paper 003 Sec. V; physics.md 4.2.  The operating points are chosen, see
:mod:`linearize.shift_points`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from math import inf

import casadi as ca
import numpy as np

from linearize.axis import Travel
from linearize.cuts import Guard, Interval, Jump, Level, Region
from linearize.equilibrium import OperatingPoint, operating_point
from linearize.modes import (
    Box,
    HybridModel,
    Mode,
    Placing,
    hybrid_modes,
    linearised,
    placed_at,
)
from linearize.reduction import DesignModel
from linearize.shift_points import SLIDING_M_S, ShiftPoints, require_moved, shift_points
from linearize.shifting import (
    FLOWS,
    MASSES,
    POSITION,
    PRESSURES,
    VELOCITY,
    carried_share,
    driving_model,
    shift_model,
    switched_shift_model,
)
from linearize.stopped import AT_STOPS, guarded, stop_cut
from workbench.effects.forces import EndStops
from workbench.effects.solenoid_valve import SolenoidValve
from workbench.plant import Plant
from workbench.plants.gearbox import COMMANDS, MAIN

NEUTRAL_M, NEUTRAL_M_S = 1e-4, 1e-2  # held where it is nearer and slower than this
BESIDE_M = 1e-9  # to either side of Neutral
AT_NEUTRAL = Interval("held at Neutral", -NEUTRAL_M, NEUTRAL_M, 0.0, (POSITION, VELOCITY))

DIRECTIONS = {
    VELOCITY: (
        Interval("towards Low", -inf, 0.0, -SLIDING_M_S),
        Interval("towards High", 0.0, inf, SLIDING_M_S),
    )
}
"""A cut for a model that keeps dry friction: its sign is that of the direction."""


def gearbox_modes(
    plant: Plant,
    points: ShiftPoints | None = None,
    pieces: int = 1,
    model: DesignModel | None = None,
) -> HybridModel:
    """The paper's eight modes with the mass flows as inputs, and the one held at Neutral.

    The flow at a point is what the valve passes at its pressure.  With several ``pieces`` each side
    has as many operating points; see :func:`side_cut`.

    Raises
    ------
    NoOperatingPointError
        See :func:`linearize.shift_points.require_moved`.
    """
    require_moved(plant)
    model = model or shift_model(plant)
    points = points or shift_points(model)
    passed = valve_flows(plant)
    cuts: dict[str, tuple[Region, ...]] = {POSITION: side_cut(model, pieces)}
    for number, flow in enumerate(FLOWS):
        (vents, low_pa), (charges, high_pa) = points.by_valve
        out_kg_s = float(passed(0.0, low_pa)[number])
        into_kg_s = float(passed(1.0, high_pa)[number])
        cuts[flow] = (
            Interval(f"{number + 1} {vents}", -inf, 0.0, out_kg_s),
            Interval(f"{number + 1} {charges}", 0.0, inf, into_kg_s),
        )
    hybrid = hybrid_modes(plant, cuts, _placing(FLOWS, points), model)
    modes = (held_at_neutral(model, points), *hybrid.modes)
    return replace(hybrid, modes=modes, jumps=picked_up(model))


def switched_modes(
    plant: Plant,
    points: ShiftPoints | None = None,
    pieces: int = 1,
    model: DesignModel | None = None,
) -> HybridModel:
    """The eight modes with the commands of the valves, which choose the mode and are no inputs.

    What the valves pass stands in A and in the drift.
    """
    model = model or switched_shift_model(plant)
    points = points or shift_points(model)
    cuts = {POSITION: side_cut(model, pieces), **valve_cut(points)}
    made = hybrid_modes(plant, cuts, _placing(COMMANDS, points), model)
    return replace(made, jumps=picked_up(model))


def resting_modes(plant: Plant) -> HybridModel:
    """The eight modes with the commands of the valves, and the piston held at Neutral and the ends.

    For those who follow the piston: contacts carry whatever the pressures press with.  At Neutral
    they hold it at any speed, since what is not held there has an estimated speed that is not slow.
    """
    model = switched_shift_model(plant)
    points = shift_points(model)
    placing = _placing(COMMANDS, points)
    cuts = {**valve_cut(points), POSITION: side_cut(model)}
    return _with_rests(plant, model, cuts, placing, neutral_guards(model)[2:])


def driving_modes(plant: Plant) -> HybridModel:
    """Sides x {slide -, stick, slide +}, held at Neutral and at both ends, under mass flows.

    Over 50 ms of driving the piston stands as long as it moves, by dry friction and detent, while
    the chambers fill and empty: see :func:`linearize.shifting.driving_model`.  What
    :func:`linearize.placement.placed_modes` begins with.
    """
    model = driving_model(plant)
    cuts = {POSITION: side_cut(model), VELOCITY: _travel(model).friction_cut()}
    return _with_rests(plant, model, cuts, _at_room_temperature(plant), neutral_guards(model))


def _travel(model: DesignModel) -> Travel:
    return Travel(
        position=POSITION,
        velocity=VELOCITY,
        resting=NEUTRAL_M_S,
        sliding=SLIDING_M_S,
        ends=(-_stroke_m(model), _stroke_m(model)),
    )


def _with_rests(
    plant: Plant,
    model: DesignModel,
    cuts: Mapping[str, Iterable[Region]],
    placing: Placing,
    at_neutral: tuple[Guard, ...],
) -> HybridModel:
    """The modes of these cuts, and before them those in which the piston is held.

    ``at_neutral`` is what the piston is held by there.
    """
    travel = _travel(model)
    still = {name: cut for name, cut in cuts.items() if name != VELOCITY}

    def held(region: Region) -> HybridModel:
        return hybrid_modes(plant, still | {POSITION: (region,)}, placing, model)

    neutral = [replace(mode, guards=at_neutral) for mode in held(AT_NEUTRAL).modes]
    ends = (held(end) for end in stop_cut(travel))
    stopped = (guarded(each, travel, mode) for each in ends for mode in each.modes)
    free = hybrid_modes(plant, cuts, placing, model).modes
    return HybridModel(plant, model, (*neutral, *stopped, *free), AT_STOPS, picked_up(model))


def _at_room_temperature(plant: Plant) -> Placing:
    """Each cut signal at its point, vented, with the gas at the temperature of the supply."""
    thin = shift_model(plant)

    def placed(model: DesignModel, box: Box) -> OperatingPoint:
        at = {name: region.point for name, region in box.items()}
        x = [at.get(n, v) for n, v in zip(thin.states, thin.initial, strict=True)]
        whole = dict(zip(thin.plant.model.states, thin.full(x).full().ravel(), strict=True))
        return operating_point(model, {name: float(whole[name]) for name in MASSES} | at)

    return placed


def valve_cut(points: ShiftPoints) -> dict[str, tuple[Level, ...]]:
    """Each valve released and energised."""
    labels = [label for label, _ in points.by_valve]
    return {
        command: tuple(map(Level, (f"{number + 1} {label}" for label in labels), (0.0, 1.0)))
        for number, command in enumerate(COMMANDS)
    }


def side_cut(model: DesignModel, pieces: int = 1) -> tuple[Interval, ...]:
    """Low and High side, each in so many pieces over which a volume changes by the same ratio.

    Of the two volumes that is the one that the side shrinks to its dead volume: 1 on the Low side,
    2 on the High one.  Each point is where that volume is the geometric mean of its piece.
    """
    stroke_m = _stroke_m(model)
    volume = model.quantities("chamber_1.volume_m3", "chamber_2.volume_m3")
    cut = []
    for row, (label, ends_m) in enumerate(
        {"Low side": (-stroke_m, 0.0), "High side": (0.0, stroke_m)}.items()
    ):
        places_m = np.linspace(*ends_m, 1001)
        x = np.tile(model.initial[:, None], len(places_m))
        x[model.states.index(POSITION)] = places_m
        sizes = np.log(volume(x, model.plant.nominal[0]).full()[row])
        steps = np.interp(np.linspace(0.0, 1.0, 2 * pieces + 1), *_rising(sizes, places_m))
        ends = (-inf, 0.0) if row == 0 else (0.0, inf)
        edges = [ends[0], *map(float, steps[2:-1:2]), ends[1]]
        for k in range(pieces):
            name = f"{label} {k + 1}/{pieces}" if pieces > 1 else label
            cut.append(Interval(name, edges[k], edges[k + 1], float(steps[2 * k + 1])))
    return tuple(cut)


def held_at_neutral(model: DesignModel, points: ShiftPoints | None = None) -> Mode:
    """The ninth mode: x = 0 and v = 0, while F_L >= 0 below Neutral and F_H <= 0 above.

    Both forces are linear in the pressures; they are read off the model on either side.
    """
    half_pa = (points or shift_points(model)).charging_pa
    point = operating_point(model, {**dict.fromkeys(PRESSURES, half_pa), POSITION: 0.0})
    return replace(linearised(model, {POSITION: AT_NEUTRAL}, point), guards=neutral_guards(model))


def neutral_guards(model: DesignModel) -> tuple[Guard, ...]:
    """Slow, and pushed to Neutral from both sides."""
    slow = (Guard({VELOCITY: sign}, NEUTRAL_M_S) for sign in (1.0, -1.0))
    return (*slow, _push(model, -1.0), _push(model, 1.0))


def picked_up(model: DesignModel) -> tuple[Jump, ...]:
    """The main piston picks up the floating one at Neutral on its way up, and slows down.

    On the way down the floating one stays behind at its shoulder.
    """
    return (Jump(POSITION, 0.0, VELOCITY, carried_share(model)),)


def valve_flows(plant: Plant) -> Callable[[float, float], np.ndarray]:
    """(command, chamber pressure) -> flow through each valve, kg/s, shape (2,)."""
    model = switched_shift_model(plant)
    valves = [e for e in model.plant.effects if isinstance(e, SolenoidValve)]
    flows = [model.plant.model.flows[v.name, "MassFlow", v.chamber] for v in valves]
    (passed,) = model.reduced([ca.vertcat(*flows)])
    f = ca.Function("flows", [*model.symbols], [passed])

    def flows_at(command: float, pressure_pa: float) -> np.ndarray:
        return f([pressure_pa, pressure_pa, 0.0, 0.0], [command, command]).full().ravel()

    return flows_at


def _placing(inputs: tuple[str, str], points: ShiftPoints):
    """Pressures by what the valves do, the speed as given."""
    pressure_pa = [value for _, value in points.by_valve]

    def placed(model: DesignModel, box: Mapping[str, Region]):
        charging = [bool(box[name].point > 0.0) for name in inputs]
        values = {p: pressure_pa[on] for p, on in zip(PRESSURES, charging, strict=True)}
        return placed_at({VELOCITY: points.velocity_m_s, **values})(model, box)

    return placed


def _push(model: DesignModel, side: float) -> Guard:
    """The force at rest on one side of Neutral, over the mass, towards it."""
    x, u = model.initial.copy(), np.zeros(len(model.commands))
    x[model.states.index(POSITION)], row = side * BESIDE_M, model.states.index(VELOCITY)
    columns = [model.states.index(name) for name in PRESSURES]
    slope = model.jacobians(x, u)[0].full()[row, columns]
    offset = float(model.f(x, u)[0][row]) - slope @ x[columns]
    weights = dict(zip(PRESSURES, map(float, -side * slope), strict=True))
    return Guard(weights, -side * float(offset))


def _rising(values: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Share of the way from the first value to the last one, with the places."""
    return (values - values[0]) / (values[-1] - values[0]), places


def _stroke_m(model: DesignModel) -> float:
    """From Neutral to either end."""
    stops = (e for e in model.plant.effects if isinstance(e, EndStops) and e.body == MAIN)
    return float(next(stops).upper_m)

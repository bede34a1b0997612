"""Whether stops and chambers of one body, as a rig file gives them, are of one stroke.

Beyond the stroke of a chamber the dead volume is left, and soon nothing: the model keeps a tenth of
it there, which no longer shrinks, and a search takes that for another dead volume.  Stops may lie
within the rest of it.  Chambers that two bodies close are left out, as both ends of neither say
what is left.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import hypot
from typing import TYPE_CHECKING

from workbench.effect import Effect
from workbench.effects.forces import EndStops
from workbench.parts import Chamber
from workbench.plant import Plant
from workbench.rig_text import RigText
from workbench.units import public_name

if TYPE_CHECKING:
    from workbench.rig import Rig

ENDS = ("lower_m", "upper_m", "stroke_m", "rest_m")  # fields that say where a stroke is
SLACK_M, SLACK = 1e-3, 0.01  # of the stroke: stops give way, and lengths are read off
USABLE = 0.9  # of the dead volume: the model keeps the rest of it, however far a body goes
DEVIATIONS = 3.0  # that a fit may have moved what is uncertain


@dataclass(frozen=True)
class Misfit:
    """Ends that cannot be: what is, what is expected, and the full names that it is about."""

    what: str
    expected: str
    names: tuple[str, ...]


def require_room(text: RigText, rig: Rig) -> None:
    """Refuse stops that do not fit the chambers of their body, at the first key that was typed.

    Raises
    ------
    InputError
        With the reach of both, and the keys that belong together.
    """
    typed = text.flat("values")
    for misfit in misfits(rig):
        key = next((key for key in map(public_name, misfit.names) if key in typed), None)
        text.wrong(("values", key) if key else ("plant",), misfit.what, expected=misfit.expected)
    text.finish()


def misfits(rig: Rig) -> Iterator[Misfit]:
    """Stops the wrong way round, and stops beyond the stroke of a chamber."""
    for stops in (e for e in rig.plant.effects if isinstance(e, EndStops) and not e.absent):
        ends, names = (float(stops.lower_m), float(stops.upper_m)), _names(stops)
        reach = f"{stops.name} reach from {_between(*ends)}"
        if ends[0] >= ends[1]:
            yield Misfit(reach, "the lower end below the upper one", names)
            continue
        beyond = [c for c in _chambers(rig.plant, stops.body) if _sticks_out(rig, stops, c)]
        if beyond:
            what = f"{reach}, and the stroke of {' and '.join(map(_stroke, beyond))}"
            names += tuple(name for chamber in beyond for name in _names(chamber))
            yield Misfit(what, _together(rig.plant, stops), names)


def _chambers(plant: Plant, body: str) -> list[Chamber]:
    """The chambers that this body alone closes."""
    return [p for p in plant.parts if isinstance(p, Chamber) and p.bodies == (body,)]


def _sticks_out(rig: Rig, stops: EndStops, chamber: Chamber) -> bool:
    """Whether stops let a body out of a chamber, to where its volume no longer shrinks."""
    begin_m, stroke_m = float(chamber.lower_m), float(chamber.stroke_m)
    out_m = max(begin_m - float(stops.lower_m), float(stops.upper_m) - begin_m - stroke_m)
    slack_m = max(SLACK_M, SLACK * stroke_m)
    names = (*_names(stops), *_names(chamber))
    uncertain_m = hypot(*(rig.standard_deviation(name) for name in names))
    dead_m3 = float(chamber.dead_volume_m3 * (1.0 + chamber.dead_volume_change))
    gas_m = USABLE * dead_m3 / float(chamber.area_m2)
    return out_m > slack_m + gas_m + DEVIATIONS * uncertain_m


def _together(plant: Plant, stops: EndStops) -> str:
    """The keys of a rig file that say where the stroke of a body is."""
    beside = (m for m in plant.members if getattr(m, "body", "") == stops.body and m is not stops)
    keys = [public_name(name) for member in (stops, *beside) for name in _names(member)]
    return f"stops within it: {', '.join(keys[:-1])} and {keys[-1]} belong together"


def _names(member: Effect) -> tuple[str, ...]:
    """Full names of what a member says of the stroke."""
    return tuple(f"{member.name}.{key}" for key in ENDS if key in member.parameters())


def _stroke(chamber: Chamber) -> str:
    begin_m = float(chamber.lower_m)
    return f"{chamber.name} from {_between(begin_m, begin_m + float(chamber.stroke_m))}"


def _between(lower_m: float, upper_m: float) -> str:
    return f"{1e3 * lower_m:.6g} mm to {1e3 * upper_m:.6g} mm"

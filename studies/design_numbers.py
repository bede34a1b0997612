"""Numbers that a specification gives to a design, and whether its limits leave an MPC any room."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

from controllers import CONTROLLERS
from controllers.mpc_limits import state_ends
from controllers.mpc_spec import MpcSpec
from controllers.positioning import STATES
from linearize.axes import stroke_m
from linearize.standard import POSITION, PRESSURES, SUPPLY, VELOCITY
from studies.specification import Limit, Specification
from workbench.errors import InputError, Message
from workbench.plant import Plant

KEPT_BY = {(POSITION,): ("lowest_m", "below_end_m"), PRESSURES: ("lowest_pa", "below_supply_pa")}
"""Numbers of an MPC that keep states above and below."""


def design_numbers(spec: Specification, method: str, plant: Plant) -> dict[str, Any]:
    """Numbers of a design: those of its table, and for an MPC its limits where the table has none.

    The MPC keeps one speed both ways and one pair of limits for both pressures: the tightest.

    Raises
    ------
    InputError
        If limits leave no room besides what an MPC keeps, or each other.
    """
    own = dict(spec.numbers.get(method, {}))
    if method not in CONTROLLERS or CONTROLLERS[method].spec is not MpcSpec:
        return own
    numbers: dict[str, float] = {}
    limits = {each.figure: each for each in spec.asked if isinstance(each, Limit)}
    if POSITION in limits:
        place = limits[POSITION]
        numbers["lowest_m"] = max(place.least, 0.0)
        numbers["below_end_m"] = max(stroke_m(plant) - place.most, 0.0)
    if VELOCITY in limits:
        ways = -limits[VELOCITY].least, limits[VELOCITY].most
        numbers["fastest_m_s"] = min(speed for speed in ways if speed > 0.0)
    pressures = [limits[name] for name in PRESSURES if name in limits]
    if pressures:
        highest_pa = min(each.most for each in pressures)
        numbers["below_supply_pa"] = max(float(plant.values[SUPPLY]) - highest_pa, 0.0)
        if (lowest_pa := max(each.least for each in pressures)) > 0.0:
            numbers["lowest_pa"] = lowest_pa
    if cramped := [*_cramped(limits, own, numbers | own, method, plant)]:
        raise InputError(*cramped)
    return numbers | own


@dataclass(frozen=True)
class _End:
    """One end of what an MPC keeps, and the limit that asks for it if one does."""

    value: float
    asked: Limit | None = None


def _cramped(
    limits: Mapping[str, Limit],
    own: Mapping[str, Any],
    numbers: Mapping[str, Any],
    method: str,
    plant: Plant,
) -> Iterator[Message]:
    """What is wrong with limits between which nothing is left, by the name in the file."""
    kept = {name: numbers.get(name, default) for name, default in vars(MpcSpec()).items()}
    low, high = state_ends(plant, MpcSpec(**kept)).tolist()
    for names, (least, most) in KEPT_BY.items():
        asked, at = [limits[name] for name in names if name in limits], STATES.index(names[0])
        yield from _limits_without_room(
            _tightest([] if least in own else asked, low[at], 1),
            _tightest([] if most in own else asked, high[at], -1),
            method,
        )


def _tightest(limits: Iterable[Limit], value: float, side: int) -> _End:
    """An end at a value, the lower one with ``side`` 1, and the limit that it comes from if any."""
    ends = ((each.least if side > 0 else each.most, each) for each in limits)
    # from a distance to the end of the stroke or to the supply a value comes back rounded
    same = (each for end, each in ends if abs(end - value) <= 1e-9 * abs(value) < inf)
    return _End(value, next(same, None))


def _limits_without_room(low: _End, high: _End, method: str) -> Iterator[Message]:
    wrong = high.asked or low.asked
    if low.value < high.value or wrong is None:
        return
    words, most, other = ("above", "least", low) if high.asked else ("below", "most", high)
    reason = f"of {other.asked.name}" if other.asked else f"the {most} that {method} keeps"
    # one place is a limit both ways to a state, but none is below 0
    one = wrong.figure == POSITION and wrong.least == -wrong.most
    ends = f"0 to {wrong.shown(wrong.most)}" if one else wrong.text
    expected = f"some of it {words} {wrong.shown(other.value)}, {reason}"
    yield Message(f"{ends} leaves {method} no room", wrong.name, expected)

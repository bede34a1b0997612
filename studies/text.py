"""Results as text for a terminal: aligned columns, in the units people read."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import inf, isfinite

from studies.tables import NEVER, Table, note
from workbench.diagnosis.result import told
from workbench.units import display_scale, display_unit, public_name

RATE = "rate of "  # before the name of a quantity
LONG_S = 9e-3  # above, a number of microseconds has more than four digits


def columns(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table: numbers to the right, words to the left; noted, see :mod:`studies.tables`."""
    table = Table(tuple(map(str, head)), tuple(tuple(map(str, row)) for row in rows))
    note(table)
    return table.text


def number(value: float, digits: int = 4) -> str:
    """A number as people write it; a dash where there is none."""
    if not isfinite(value):
        return "-"
    return f"{value:.{digits}g}"


def until(value: float, digits: int = 4) -> str:
    """A time until something is reached, which may be never; a dash where there is none."""
    return NEVER if value == inf else number(value, digits)


def clock(times_s: Iterable[float]) -> tuple[str, float]:
    """The unit of the wall times of a table, and its factor: us, or ms where one takes long."""
    longest_s = max((time_s for time_s in times_s if isfinite(time_s)), default=0.0)
    return ("ms", 1e3) if longest_s >= LONG_S else ("us", 1e6)


def percent(share: float, digits: int = 0) -> str:
    """A share as a percentage; a dash where there is none."""
    return f"{100.0 * share:.{digits}f} %" if isfinite(share) else "-"


def outside_band(share: float) -> str:
    """How many lags of a correlation are outside its band, or that it is not known."""
    if not isfinite(share):
        return "not known: nothing was recorded of it, or nothing changes"
    return f"{percent(share)} of the lags outside the band"


def removed(share: float) -> str:
    """A share of a misfit that something removes: more than all of it is none."""
    return percent(told(share), 1)


def shown(value: float, name: str, digits: int = 4) -> str:
    """A quantity in the unit people read it in: ``0.0919 mm^2``."""
    if not isfinite(value):
        return "-"
    return f"{number(display_scale(name).from_si(value), digits)} {display_unit(name)}".strip()


def spread(value: float, deviation: float, name: str, digits: int = 4) -> str:
    """A quantity with its standard deviation, where it has one."""
    known = f" ± {shown(deviation, name, 2)}" if isfinite(deviation) else ""
    return shown(value, name, digits) + known


def labelled(name: str) -> str:
    """A quantity in words with its unit, for an axis: ``chamber a pressure (bar)``.

    The rate of a quantity has its unit per second, ``rate of valve command (V/s)``.
    """
    unit = display_unit(name)
    unit = f"{unit or 1}/s" if name.startswith(RATE) else unit
    words = public_name(name).replace(".", " ").replace("_", " ")
    return f"{words} ({unit})" if unit else words

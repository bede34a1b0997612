"""Units at the border: what a user types becomes SI, and names lose or gain their unit.

Inside the code every quantity is in SI, pressures are absolute, and a name ends in its unit.
Only this file knows others.  Pint is loaded when the first unit is read, never before.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from decimal import Context, Decimal
from functools import lru_cache
from math import isfinite
from typing import Any

from workbench.errors import nearest
from workbench.spelled_units import GAUGE, spelled

STANDARD_ATMOSPHERE_PA = 101325.0
NO_UNIT = frozenset({"1", "-", "dimensionless"})  # what tables write where there is none

_UNITS = {
    # suffix: (SI unit, unit for people)
    "m": ("m", "mm"),
    "m_s": ("m/s", "m/s"),
    "m_s2": ("m/s^2", "m/s^2"),
    "m2": ("m^2", "mm^2"),
    "m3": ("m^3", "cm^3"),
    "m3_s": ("m^3/s", "l/s"),
    "m3_pa": ("m^3/Pa", "m^3/Pa"),
    "m3_s_pa": ("m^3/(s Pa)", "m^3/(s Pa)"),
    "m_pa": ("m/Pa", "m/Pa"),
    "m_v": ("m/V", "mm/V"),
    "m2_v": ("m^2/V", "mm^2/V"),
    "m_n": ("m/N", "m/N"),
    "kg": ("kg", "kg"),
    "kg_m": ("kg/m", "kg/m"),
    "kg_s": ("kg/s", "g/s"),
    "kg_m2": ("kg m^2", "kg m^2"),
    "kg_m3": ("kg/m^3", "kg/m^3"),
    "kg_s_pa": ("kg/(s Pa)", "kg/(s Pa)"),
    "n": ("N", "N"),
    "n_m": ("N/m", "N/m"),
    "n_m2": ("N/m^2", "N/m^2"),
    "n_m_rad": ("N m/rad", "N m/rad"),
    "n_m_s": ("N m s", "N m s"),
    "n_m_s_rad": ("N m s/rad", "N m s/rad"),
    "n_s_m": ("N s/m", "N s/m"),
    "n_s_m2": ("N s/m^2", "N s/m^2"),
    "n_s2_m2": ("N s^2/m^2", "N s^2/m^2"),
    "n_s3_m3": ("N s^3/m^3", "N s^3/m^3"),
    "n_pa": ("N/Pa", "N/bar"),
    "n_k": ("N/K", "N/K"),
    "pa": ("Pa", "bar"),
    "pa_s": ("Pa/s", "bar/s"),
    "pa_s_kg": ("Pa s/kg", "Pa s/kg"),
    "pa_v": ("Pa/V", "bar/V"),
    "k": ("K", "K"),
    "k_w": ("K/W", "K/W"),
    "k_j": ("K/J", "K/J"),
    "j": ("J", "J"),
    "j_k": ("J/K", "J/K"),
    "j_kg_k": ("J/(kg K)", "J/(kg K)"),
    "w": ("W", "W"),
    "w_k": ("W/K", "W/K"),
    "w_m2_k": ("W/(m^2 K)", "W/(m^2 K)"),
    "s": ("s", "s"),
    "s_m": ("s/m", "s/m"),
    "hz": ("Hz", "Hz"),
    "v": ("V", "V"),
    "v_s": ("V/s", "V/s"),
    "a": ("A", "A"),
    "ohm": ("ohm", "ohm"),
    "h": ("H", "H"),
    "per_h": ("1/H", "1/H"),
    "rad": ("rad", "deg"),
    "rad_s": ("rad/s", "deg/s"),
    "per_pa": ("1/Pa", "1/bar"),
    "per_k": ("1/K", "1/K"),
    "per_v": ("1/V", "1/V"),
    "per_m": ("1/m", "1/m"),
}
_TYPED = (
    "m, mm, cm, um, m/s, mm/s, kg, g, N, kN, Pa, kPa, MPa, bar, mbar, psi, bar_gauge, mbar_gauge, "
    "kPa_gauge, psi_gauge, K, degC, V, mV, s, ms, us, min, h, Hz, rad, deg, A, mA, W, J, l, cm^3, "
    "mm^2, m^2, m^3, kg/s, g/s, l/s, l/min, N/m, N/mm, N s/m, N m, W/K, W/(m^2 K), percent, %"
)
_NUMBER = r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|(?:inf|nan)\b)"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(.*?)\s*")


class UnitError(ValueError):
    """A quantity that cannot be read, or whose unit measures something else."""


@dataclass(frozen=True)
class Scale:
    """From a unit to SI: ``number * multiplier / divisor + offset``, with arrays as with numbers.

    One of multiplier and divisor is 1: 5 mm is 5 / 1000, the float nearest to 0.005.
    """

    multiplier: float = 1.0
    divisor: float = 1.0
    offset: float = 0.0

    @property
    def factor(self) -> float:
        return self.multiplier / self.divisor

    def to_si(self, number: Any) -> Any:
        return number * self.multiplier / self.divisor + self.offset

    def exact(self, number: str) -> float:
        """The SI value of a decimal number, rounded once: ``0.05 mm^2`` is 5e-8."""
        product = Decimal(number) * Decimal(self.multiplier) / Decimal(self.divisor)
        return float(product) + self.offset

    def from_si(self, value: Any) -> Any:
        return (value - self.offset) * self.divisor / self.multiplier


def suffix(name: str) -> str:
    """The unit a name ends in, ``m_s`` for ``slide.velocity_m_s``; empty if dimensionless."""
    words = name.rpartition(".")[2].split("_")
    for first in range(1, len(words)):
        if "_".join(words[first:]) in _UNITS:
            return "_".join(words[first:])
    return ""


def _pair(name: str) -> tuple[str, str]:
    """SI unit and the unit for display; N m of a torque and N/m of a stiffness read alike."""
    unit = suffix(name)
    if unit == "n_m" and name.rpartition(".")[2].startswith("torque"):
        return "N m", "N m"
    return _UNITS[unit] if unit else ("", "")


def public_name(name: str) -> str:
    """A name without its unit: ``slide.position`` for ``slide.position_m``."""
    unit = suffix(name)
    return name[: -len(unit) - 1] if unit else name


def si_unit(name: str) -> str:
    """The SI unit of a quantity by its full name; empty if dimensionless."""
    return _pair(name)[0]


def display_unit(name: str) -> str:
    """The unit a person reads this quantity in: bar, mm, N; empty if dimensionless."""
    return _pair(name)[1]


def scale(unit: str, name: str, ambient_pa: float = STANDARD_ATMOSPHERE_PA) -> Scale:
    """How numbers in ``unit`` become the SI value of the quantity called ``name``.

    ``bar_gauge``, ``psig`` and the like count from the ambient pressure ``ambient_pa``.

    Raises
    ------
    UnitError
        If the unit is unknown (the nearest one is named) or measures something else.
    """
    unit, target = spelled(unit.strip()), si_unit(name)
    plain = unit.removesuffix(GAUGE)
    if plain != unit and target != "Pa":
        raise UnitError(f"unit '{unit}' is a gauge pressure; expected {_wanted(name)}")
    found = _scale(plain, target, unit, _wanted(name))
    return replace(found, offset=ambient_pa) if plain != unit else found


def display_scale(name: str) -> Scale:
    """How numbers in the display unit become the SI value of this quantity."""
    return scale(display_unit(name), name)


def quantity(text: Any, name: str, ambient_pa: float = STANDARD_ATMOSPHERE_PA) -> float:
    """The SI value of what a user typed for ``name``: ``"6 bar_gauge"``, ``"0.05 mm^2"``.

    A dimensionless quantity takes a number, plain or as text, or a percentage.

    Raises
    ------
    UnitError
        If it is no number, has no unit, or one that is unknown or does not fit.
    """
    number, unit = split(text, name)
    return scale(unit, name, ambient_pa).exact(number)


def deviation(text: Any, name: str, value: float) -> float:
    """One standard deviation in SI: relative to ``value`` (``"1 %"``) or in a unit (``"2 K"``).

    Raises
    ------
    UnitError
        As :func:`quantity`; also if it is negative, or relative to a value of zero.
    """
    typed, unit = split(text, name)
    number = float(typed)
    if not (isfinite(number) and number >= 0):
        raise UnitError(f"'{text}' is no standard deviation; expected a number from 0 on")
    if unit not in {"%", "percent"}:
        return replace(scale(unit, name), offset=0.0).exact(typed)
    if value == 0:
        raise UnitError(f"'{text}' of 0 says nothing; expected {_wanted(name) or 'a number'}")
    return abs(value) * number / 100.0


def split(text: Any, name: str) -> tuple[str, str]:
    """Number and unit of what a user typed, as text; no unit where none is needed."""
    if isinstance(text, bool) or not isinstance(text, int | float | str):
        raise UnitError(f"{text!r} is no quantity; expected {_example(name)}")
    found = _QUANTITY.fullmatch(str(text))
    if not found:
        raise UnitError(f"'{text}' does not start with a number; expected {_example(name)}")
    number, unit = found[1], found[2]
    if unit.startswith(","):
        raise UnitError(f"'{text}' has a comma; expected a decimal point")
    if not unit and si_unit(name):
        example = _example(name, number) if isfinite(float(number)) else _example(name)
        raise UnitError(f"'{text}' has no unit; expected {example}")
    return number, unit


def written(value: float, name: str) -> str:
    """The quantity as text that reads back to the very same float, in its display unit if it can.

    A value that the display unit cannot hold to the last bit is written in SI.
    """
    if not display_unit(name):
        return repr(float(value)).removesuffix(".0")
    shown = display_scale(name)
    number = Decimal(repr(float(value))) * Decimal(shown.divisor) / Decimal(shown.multiplier)
    number = number.normalize(Context(prec=17))
    text = f"{number:f}" if not number or 1e-4 <= abs(number) < 1e7 else f"{number:e}"
    if shown.exact(text) == value:
        return f"{text} {display_unit(name)}"
    return f"{float(value)!r} {si_unit(name)}"


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


@lru_cache(maxsize=512)
def _scale(unit: str, target: str, typed: str, wanted: str) -> Scale:
    if unit == target or (unit in NO_UNIT and not target):
        return Scale()
    if unit in {"%", "percent"} and not target:
        return Scale(divisor=100.0)
    if not target:
        raise UnitError(f"unit '{typed}' on a dimensionless quantity; expected a plain number")
    import pint

    registry = _registry()
    try:
        parsed = registry.parse_units(re.sub(r"(?<=[A-Za-z])([23])(?!\d)", r"^\1", unit))
    except Exception:  # pint raises whatever its tokenizer met
        near = nearest(typed, _TYPED.split(", ")) or nearest(typed.lower(), _TYPED.split(", "))
        hint = f"; did you mean '{near}'?" if near else f"; expected {wanted}"
        raise UnitError(f"unit '{typed}' is unknown{hint}") from None
    try:
        zero, one = (registry.Quantity(n, parsed).to(target).magnitude for n in (0.0, 1.0))
    except pint.DimensionalityError:
        raise UnitError(f"unit '{typed}' does not fit; expected {wanted}") from None
    factor, offset = _tidy(one - zero), _tidy(zero)
    divisor = _tidy(1.0 / factor)
    if factor < 1 and divisor == round(divisor):
        return Scale(divisor=divisor, offset=offset)
    return Scale(factor, offset=offset)


def _tidy(number: float) -> float:
    """Without the rounding errors of pint's conversion: 1e-6, not 1.0000000000000002e-6."""
    short = float(f"{number:.12g}")
    return short if abs(short - number) <= 1e-15 * abs(number) else number


def _wanted(name: str) -> str:
    """The units that fit, in words."""
    return " or ".join(dict.fromkeys(filter(None, (display_unit(name), si_unit(name)))))


def _example(name: str, number: str = "1.5") -> str:
    unit = display_unit(name)
    return f'"{number} {unit}"' if unit else f"a number such as {number}"

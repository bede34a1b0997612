"""What tank curves tell of a valve, and what of it goes into the rig of a drive.

The fraction of a path is relative to the rig's own area times C_d, of which the curves show the
product only.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, isclose, nan, prod

from workbench.errors import InputError, Message, listed
from workbench.identification.estimate import Estimate
from workbench.identification.result import Curve, Identified
from workbench.rig import Rig
from workbench.units import public_name


@dataclass(frozen=True)
class ValveNames:
    """Full names of the parameters of valve and dead zone."""

    valve: str = "valve"
    zone: str = "valve_dead_zone"

    def shape(self, charging: bool) -> list[str]:
        """Area, b, a and m of a path."""
        side = "supply" if charging else "exhaust"
        keys = (f"{side}_fraction", f"{side}_critical_ratio", "cracking_ratio", "subsonic_index")
        return [f"{self.valve}.{key}" for key in keys]

    @property
    def before(self) -> list[str]:
        """What must be known before, and stays."""
        zone = [f"{self.zone}.{key}" for key in ("centre_v", "half_width_v")]
        return [*zone, f"{self.valve}.leak_area_m2"]

    @property
    def fractions(self) -> tuple[str, str]:
        """The sizes of both paths."""
        return self.shape(True)[0], self.shape(False)[0]

    @property
    def common(self) -> list[str]:
        """The rig's own parameters that all curves share."""
        return [f"{self.valve}.area_exponent", *self.shape(True), *self.shape(False)[:2]]

    @property
    def area(self) -> tuple[str, str]:
        """What the fraction of a path is relative to: the largest area and its C_d."""
        return f"{self.valve}.flow_area_m2", f"{self.valve}.discharge_coefficient"

    def shape_of(self, rig: Rig) -> list[str]:
        """All parameters of valve and dead zone in a rig."""
        members = (self.valve, self.zone)
        return [name for name in rig.plant.values if name.rpartition(".")[0] in members]


@dataclass(frozen=True, kw_only=True)
class TankCurve(Curve):
    """One curve: pressure over time from the opening on.

    ``area_m2`` is the effective area C_d A(u); all are estimates with their deviations.
    """

    command_v: float
    charging: bool
    area_m2: Estimate
    critical_ratio: Estimate
    cracking_ratio: Estimate
    subsonic_index: Estimate

    @property
    def shape(self) -> dict[str, Estimate]:
        """The shape of the flow function, by the letters of the paper."""
        return {"b": self.critical_ratio, "a": self.cracking_ratio, "m": self.subsonic_index}

    @property
    def shut(self) -> bool:
        """No flow is seen at this command: the shape of the path is what the rig said of it."""
        return self.area_m2.value <= self.area_m2.deviation


@dataclass(frozen=True, kw_only=True)
class FlowFit(Identified):
    """Flow parameters per path and command, and the errors that the rig's few parameters leave.

    ``rig_errors_pa`` is the MAE of each curve with the improved rig, in the order of ``curves``.
    """

    curves: tuple[TankCurve, ...]
    rig_errors_pa: tuple[float, ...]
    names: ValveNames = ValveNames()

    def beside(self, rig: Rig) -> tuple[Estimate, ...]:
        """The area that the fractions are relative to, known now: its product was measured.

        Into another rig go the dead zone and all that shapes the paths, since the fractions hold
        behind them only.

        Raises
        ------
        InputError
            If the other rig has another area, and fixes it or what is relative to it.
        """
        own, names = self.rig.plant.values, self.names
        measured = {each.name for each in self.taken(rig)} & set(names.fractions)
        if not measured or any(name not in rig.plant.values for name in names.area):
            return super().beside(rig)
        self._check_area(rig)
        unseen = set(names.fractions) - measured - self.rig.fixed
        area = Estimate(names.area[0], own[names.area[0]], 0.0)
        kept = tuple(self._same_flow(rig, name) for name in sorted(unseen))
        return (area, *kept, *(() if rig is self.rig else self._shape(rig, unseen)))

    def _shape(self, rig: Rig, unseen: set[str]) -> tuple[Estimate, ...]:
        """What the fit had of valve and dead zone, and another rig has otherwise."""
        own, there = self.rig.plant.values, rig.plant.values
        besides = {*unseen, *(each.name for each in (*self.parameters, *self.carried))}
        besides.add(self.names.area[0])
        other = (
            name
            for name in self.names.shape_of(self.rig)
            if name not in besides and own[name] != there.get(name, own[name])
        )
        known = {**dict.fromkeys(self.names.area, 0.0), **self.rig.deviations}
        return (*self.carried, *(Estimate(n, own[n], known.get(n, nan)) for n in other))

    def _same_flow(self, rig: Rig, fraction: str) -> Estimate:
        """The fraction of a path that no curve shows: it keeps the flow that its rig has.

        What the rig does not know of the area is not known of this path then.
        """
        area, there = self.names.area[0], rig.plant.values
        value = there[fraction] * self._ratio(rig)
        shares = (
            rig.standard_deviation(name) / there[name] for name in (fraction, area) if there[name]
        )
        return Estimate(fraction, value, value * hypot(*shares))

    def _ratio(self, rig: Rig) -> float:
        """C_d times area of a rig over that of the tank's."""
        there, own = rig.plant.values, self.rig.plant.values
        return prod(there[name] / own[name] for name in self.names.area)

    def _check_area(self, rig: Rig) -> None:
        held = [n for n in (*self.names.area, *self.names.fractions) if n in rig.fixed]
        if not held or isclose(self._ratio(rig), 1.0, rel_tol=1e-6):
            return
        what = f"fixes {listed(map(public_name, held))}, and the tank's valve has another area"
        expected = "the area of the tank's rig, or none of these fixed"
        raise InputError(Message(what, rig.name, expected))

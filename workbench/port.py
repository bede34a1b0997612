"""A port of a valve: the paths of one chamber to the supply and to the air."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from workbench.air import NozzleLaw, Path, path_between
from workbench.effect import Conditions, Expression, MassFlow

ChokedShare = Callable[[Expression], Expression]  # flow over choked flow by p_d/p_u: a flow law


@dataclass(frozen=True)
class Port:
    """Two paths that meet in a chamber: ``charge`` comes from the supply, ``vent`` goes to the air.

    ``line_share`` is the share of the flow that a line to the chamber lets through.
    """

    chamber: str
    line_share: Expression
    charge: Path
    vent: Path

    def flows(
        self,
        into_kg_s: Expression,
        out_kg_s: Expression,
        inlet: ChokedShare,
        outlet: ChokedShare,
    ) -> Iterator[MassFlow]:
        """What the chamber and the supply receive of the flows along both paths, by their laws."""
        charge, vent = self.charge, self.vent
        into_kg_s, out_kg_s = self.line_share * into_kg_s, self.line_share * out_kg_s
        yield MassFlow(self.chamber, into_kg_s, charge.temperature_k, inlet(charge.ratio))
        yield MassFlow("supply", -into_kg_s, charge.temperature_k)
        yield MassFlow(self.chamber, -out_kg_s, vent.temperature_k, outlet(vent.ratio))


def port(now: Conditions, chamber: str, gas_constant_j_kg_k: float | None = None) -> Port:
    """The port of a chamber; the gas constant of its supply path is the chamber's unless given."""
    gas = now[chamber]
    charge = path_between(now["supply"], gas, gas_constant_j_kg_k or gas.gas_constant_j_kg_k)
    return Port(chamber, gas.line_share, charge, path_between(gas, now["atmosphere"]))


def spool_flow_kg_s(
    path: Path,
    area_m2: Expression,
    law: ChokedShare,
    leak_area_m2: Expression,
    asymmetry: Expression,
) -> Expression:
    """Flow along a path through the controlled hole and the closed-centre leak beside it.

    mdot = [(1 + a) A psi(p_d/p_u) + A_leak psi_nozzle(p_d/p_u)] C_chk p_u / sqrt(T_u)

    ``asymmetry`` is a: positive where the path's forward direction enters a chamber; the other way
    round it counts with the other sign.

    Source: physics.md 1.1 d (the leak has the nozzle law, whatever the hole's).
    """
    towards = 2.0 * path.forward - 1.0
    area_m2 = area_m2 * (1.0 + asymmetry * towards)
    holes_m2 = area_m2 * law(path.ratio) + leak_area_m2 * NozzleLaw()(path.ratio)
    return holes_m2 * path.choked_kg_s_m2

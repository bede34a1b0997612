"""Ideal sources: parts that turn an input straight into a flow, for design models and studies."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca

from workbench.effect import Conditions, MassFlow, Part


@dataclass(frozen=True, kw_only=True)
class FlowSource(Part):
    """The mass flow into a chamber as a command, ``name.flow_kg_s``, in place of its valve.

    Gas that comes in has the supply's temperature, gas that leaves has the chamber's.

    Source: paper 003 Sec. V (valves replaced by flows); temperatures by erratum E003-11.
    """

    chamber: str

    def terms(self, now: Conditions) -> Iterator[MassFlow]:
        flow_kg_s = now[self.name].flow_kg_s
        inside_k, outside_k = now[self.chamber].temperature_k, now["supply"].temperature_k
        yield MassFlow(self.chamber, flow_kg_s, ca.if_else(flow_kg_s > 0, outside_k, inside_k))

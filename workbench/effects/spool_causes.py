"""Causes that every proportional spool valve may have, under one name and with one description."""

from __future__ import annotations

from workbench.effect import Balance, Cause

EXHAUST_RESTRICTION = Cause(
    name="exhaust_restriction",
    strength="exhaust_restriction_share",
    balance=Balance.FLOW,
    drivers=("command", "exhausting chamber pressure"),
    shown_by="exhaust from full pressure at several openings",
    source="papers 002 (silencers), 003; physics.md section 6",
)
SUPPLY_RESTRICTION = Cause(
    name="supply_restriction",
    strength="supply_restriction_share",
    balance=Balance.FLOW,
    drivers=("command", "charging chamber pressure"),
    shown_by="charging from ambient at several openings",
    source="interface.md section 6 (supply areas x (1 - share))",
)
DISCHARGE_ASYMMETRY = Cause(
    name="discharge_asymmetry",
    strength="discharge_asymmetry",
    balance=Balance.FLOW,
    drivers=("direction of flow",),
    shown_by="charging and exhausting between the same pressures",
    source="papers 000, 004; physics.md section 6 (cd_asymmetry)",
)
SPOOL_LEAK = Cause(
    name="spool_leak",
    strength="leak_area_m2",
    balance=Balance.MASS,
    drivers=("pressures while the valve is closed",),
    shown_by="valve closed for 20 s from two different pressures",
    source="papers 002 (cracking ratio, P_0), 004 (observed); physics.md 1.1 d",
)

"""A design as plain numbers for JSON, in SI: gains, margins, delays, certificate."""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING, Any

from controllers.gain_text import GainRow, gain_rows
from studies.plain import plain

if TYPE_CHECKING:
    from controllers.certificate import Certificate
    from controllers.margins import Margins
    from studies.design_report import DesignReport, LawReport

Document = dict[str, Any]


def design_document(rig_name: str, found: DesignReport) -> Document:
    """What ``workbench design`` prints; what has no end, as a gain that may grow, is null.

    ``laws`` is empty where the method has no linear law for each mode.
    """
    made = found.design
    return {
        "schema": "workbench.design/1",
        "rig": rig_name,
        "plant": made.plant.name,
        "controller": made.method,
        "sample_time_s": made.controller.sample_time_s,
        "gains": [_gains(row) for row in gain_rows(made.controller)],
        "laws": [_law(part) for part in found.laws],
    }


def _gains(row: GainRow) -> Document:
    numbers = {g.name: {"value": plain(g.value), "unit": g.unit} for g in row.gains}
    poles = [] if row.poles is None else [[p.real, p.imag] for p in row.poles]
    return {"at": row.name, "gains": numbers, "poles_per_s": poles}


def _law(part: LawReport) -> Document:
    return {
        "body": part.body,
        "delays_s": {"sensors": part.delays.sensors_s, "commands": part.delays.commands_s},
        "lags_s": {lag.name: lag.time_constant_s for lag in part.delays.lags},
        "commands_foreseen": part.delays.foreseen,
        "margins": [_margins(each, part) for each in part.margins],
        "margins_with_kalman_filter": [_numbers(each) for each in part.filtered],
        "certificate": _certificate(part.certificate),
    }


def _margins(each: Margins, part: LawReport) -> Document:
    """Of a loop that is unstable as it is: none, but what grows in it."""
    growth = part.growth.get(each.mode)
    return {
        **_numbers(each),
        "grows_s": plain(growth.grows_s) if growth else None,
        "swings_hz": plain(growth.swings_hz) if growth else None,
    }


def _numbers(each: Margins) -> Document:
    numbers = {
        "gain_down_to": each.gain[0],
        "gain_up_to": each.gain[1],
        "phase_deg": degrees(each.phase_rad),
        "delay_s": each.delay_s,
        "distance": each.distance,
        "disk_gain": each.disk_gain,
        "disk_phase_deg": degrees(each.disk_phase_rad),
    }
    named = {name: plain(value) if each.stable else None for name, value in numbers.items()}
    return {"mode": each.mode, "stable": each.stable, **named}


def _certificate(found: Certificate) -> Document:
    return {
        "unstable": list(found.unstable),
        "common": None if found.common is None else found.common.tolist(),
        "every_mix_of_gains": found.mixing,
        "decay_per_s": plain(found.decay_per_s),
        "breaking": [list(pair) for pair in found.breaking],
        "dwell_s": None if found.dwell_s is None else plain(found.dwell_s),
        "any_switching": found.any_switching,
    }

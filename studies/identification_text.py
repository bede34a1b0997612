"""Identification procedures and what they found, as text."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from math import isfinite

from studies.text import columns, shown
from workbench.errors import InputError, Message, listed, nearest
from workbench.identification import PROCEDURES
from workbench.identification.dead_volume import PROCEDURE as DEAD_VOLUME
from workbench.identification.result import Estimate, Identified, Procedure
from workbench.identification.tank_curves import FlowFit
from workbench.units import UnitError, public_name, quantity


def procedures_text() -> str:
    """One line per procedure: its name, what it gives, and the recording it needs."""
    rows = [(each.name, each.gives, each.manoeuvre) for each in PROCEDURES.values()]
    return columns(("procedure", "gives", "the recording it needs"), rows)


def known_procedure(name: str, tank: str | None = None) -> Procedure:
    """A procedure by its name, with the volume of the tank where that is given.

    Raises
    ------
    InputError
        If there is no such procedure, or it has no tank of a given volume.
    """
    if name not in PROCEDURES:
        near = nearest(name, PROCEDURES)
        expected = f"one of {listed(PROCEDURES)}"
        raise InputError(Message("there is no such procedure", name, expected, near))
    found = PROCEDURES[name]
    if tank is None:
        return found
    if found is not DEAD_VOLUME:
        raise InputError(Message(f"{name} takes no volume of a tank", "--tank", "no --tank"))
    try:
        volume_m3 = quantity(tank, "tank_volume_m3")
    except UnitError as error:
        raise InputError(Message(str(error), "--tank")) from error
    return replace(found, run=partial(found.run, tank_volume_m3=volume_m3))


def identified_text(found: Identified) -> str:
    """What was identified with standard deviations, and what the rig had."""
    own = found.rig.plant.values
    rows = [_row(each, "-") for each in found.estimates]
    rows += [_row(each, shown(own[each.name], each.name)) for each in found.parameters]
    text = columns(("identified", "value", "deviation", "rig had"), rows)
    if isinstance(found, FlowFit):
        return f"{flow_text(found)}\n\n{text}"
    errors = ", ".join(
        f"{curve.label} {shown(curve.mean_absolute_error, _measured(found))}"
        for curve in found.curves
    )
    return f"{text}\n\nmean absolute error: {errors}"


def flow_text(found: FlowFit) -> str:
    """One line per curve: area, b, a, m, and MAE of the curve's own fit and of the rig."""
    rows = []
    for curve, error_pa in zip(found.curves, found.rig_errors_pa, strict=True):
        shape = (curve.critical_ratio, curve.cracking_ratio, curve.subsonic_index)
        rows.append(
            (
                curve.label,
                shown(curve.area_m2.value, "area_m2"),
                *(f"{each.value:.3f} +- {each.deviation:.3f}" for each in shape),
                shown(curve.mean_absolute_error, "error_pa", 2),
                shown(error_pa, "error_pa", 2),
            )
        )
    return columns(("curve", "C_d A", "b", "a", "m", "MAE", "MAE, rig"), rows)


def _measured(found: Identified) -> str:
    """A name with the unit of what the curves hold."""
    return "error_n" if hasattr(found, "break_aways") else "error_pa"


def _row(each: Estimate, had: str) -> tuple[str, str, str, str]:
    spread = shown(each.deviation, each.name, 2) if isfinite(each.deviation) else "-"
    return public_name(each.name), shown(each.value, each.name), spread, had

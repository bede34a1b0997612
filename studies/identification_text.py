"""Identification procedures and what they found, as text and as JSON."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from math import inf, isfinite, nan
from textwrap import fill

from studies.documents import Document
from studies.plain import plain
from studies.text import columns, shown
from workbench.errors import InputError, Message, listed, nearest
from workbench.identification import PROCEDURES
from workbench.identification.dead_volume import PROCEDURE as DEAD_VOLUME
from workbench.identification.estimate import Estimate
from workbench.identification.result import Identified, Procedure
from workbench.identification.standing import standing
from workbench.identification.tank_curves import FlowFit, TankCurve
from workbench.units import UnitError, public_name, quantity, si_unit

WIDTH = 100  # of a guide, in characters
UNFOLLOWED = 3.0  # RMS over noise: the plant lacks something that is in the recording


def procedures_text() -> str:
    """One line per procedure, in their order: what it gives, and the recording it needs."""
    rows = [(e.name, e.first or "-", e.gives, e.manoeuvre) for e in PROCEDURES.values()]
    table = columns(("procedure", "after", "gives", "the recording it needs"), rows)
    return f"{table}\n\nworkbench identify PROCEDURE tells what to record and how it is called"


def guide_text(name: str) -> str:
    """How one procedure is done: what comes first, what to record, and the command."""
    each = known_procedure(name)
    after = f"{each.first}, whose result the rig must hold" if each.first else "nothing"
    printed = ", ".join(f"{public_name(n)} {shown(x, n)}" for n, x in each.printed.items())
    rows = (
        ("gives", each.gives),
        ("after", after),
        ("do", each.manoeuvre),
        ("record", each.channels),
        ("then", f"workbench identify {each.example}"),
        ("source", each.source),
        ("printed", f"{printed} (of the paper's own drive)"),
    )
    width = max(len(word) for word, _ in rows) + 4
    lines = [
        fill(said, WIDTH, initial_indent=f"  {word}".ljust(width), subsequent_indent=" " * width)
        for word, said in rows
    ]
    return "\n".join([name, *lines])


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
        what, _, _ = str(error).partition(";")  # what it expects is for smaller volumes, in cm^3
        raise InputError(Message(what, "--tank", 'a volume such as "0.344 l"')) from error
    if not 0.0 < volume_m3 < inf:
        raise InputError(Message(f"{tank!r} is no volume of a tank", "--tank", "one above zero"))
    return replace(found, run=partial(found.run, tank_volume_m3=volume_m3))


def identified_text(procedure: Procedure, found: Identified) -> str:
    """What was identified with standard deviations, what the rig had, and what the paper prints.

    Warnings of what stands far off or at the end of its range come last.
    """
    own, fixed = found.rig.plant.values, found.rig.fixed
    rows = [_row(each, "-", procedure) for each in found.estimates]
    for each in found.parameters:
        stays = ", fixed" if each.name in fixed else ""
        remark = "at a bound" if standing(found.rig, each).at_bound else ""
        had = shown(own[each.name], each.name) + stays
        rows.append(_row(each, had, procedure, remark))
    text = columns(("identified", "value", "deviation", "rig had", "paper 002", ""), rows)
    warnings = "".join(f"\nwarning: {said}" for said in doubts(procedure, found))
    if isinstance(found, FlowFit):
        return f"{flow_text(found)}\n\n{text}{warnings}"
    errors = ", ".join(
        f"{curve.label} {shown(curve.mean_absolute_error, _measured(found))}"
        for curve in found.curves
    )
    return f"{text}\n\nmean absolute error: {errors}{warnings}"


def doubts(procedure: Procedure, found: Identified) -> list[str]:
    """A sentence for each parameter far from the rig's value or at the end of its range.

    Those of the procedure itself come last.
    """
    said, own = [], found.rig.plant.values
    also = ", and --tank the volume of its tank" if procedure.name == DEAD_VOLUME.name else ""
    for each in found.parameters:
        name, value = public_name(each.name), shown(each.value, each.name)
        stands = standing(found.rig, each)
        if stands.at_bound:
            end = shown(stands.end, each.name)
            why = "shows nothing of it" if stands.none else "is no result"
            said.append(f"{name} {value} {why}: its range ends at {end}")
        elif stands.silent:
            spread = shown(each.deviation, each.name, 2)
            said.append(f"{name} {value} +- {spread} is no result: the recordings say little of it")
        if stands.far:
            said.append(
                f"{name} {value} lies {stands.deviations_off:.3g} prior deviations from the "
                f"rig's {shown(own[each.name], each.name)}: is the recording of this rig{also}?"
            )
    ended = [curve for curve in found.curves if curve.at_bound]
    if ended:
        many = f"{len(ended)} of {len(found.curves)} curves"
        said.append(f"{many} have values at the end of their range, which are no results")
    return [*said, *_unfollowed(found), *found.doubts]


def _unfollowed(found: Identified) -> list[str]:
    """What to say of curves that lie further from the plant than noise does."""
    far = [curve for curve in found.curves if curve.misfit > UNFOLLOWED]
    if not far:
        return []
    worst = max(far, key=lambda curve: curve.misfit)
    return [
        f"{len(far)} of {len(found.curves)} curves lie off the fit by more than noise, "
        f"{worst.label} by {worst.misfit:.2g} times: the plant does not follow this recording: "
        "a leak, the offset of a sensor, or another supply?"
    ]


def identification_document(procedure: Procedure, found: Identified) -> Document:
    """What an identification procedure found, in SI; parameters are those of the rig."""
    own = {each.name: standing(found.rig, each) for each in found.parameters}
    return {
        "schema": "workbench.identification/1",
        "procedure": procedure.name,
        "source": procedure.source,
        "rig": found.rig.name,
        "estimates": {public_name(e.name): _document(procedure, e) for e in found.estimates},
        "parameters": {
            public_name(each.name): {
                **_document(procedure, each),
                "prior_deviations_off": plain(own[each.name].deviations_off),
                "at_bound": own[each.name].at_bound,
            }
            for each in found.parameters
        },
        "curves": [
            {
                "curve": curve.label,
                "mean_absolute_error": plain(curve.mean_absolute_error),
                "at_bound": list(curve.at_bound),
            }
            for curve in found.curves
        ],
        "warnings": doubts(procedure, found),
    }


def _document(procedure: Procedure, each: Estimate) -> Document:
    printed = procedure.printed.get(each.name)
    return {
        "value": plain(each.value),
        "unit": si_unit(each.name),
        "std": plain(each.deviation),
        **({} if printed is None else {"paper": plain(printed)}),
    }


def flow_text(found: FlowFit) -> str:
    """One line per curve: area, b, a, m, and MAE of the curve's own fit and of the rig."""
    rows = []
    for curve, error_pa in zip(found.curves, found.rig_errors_pa, strict=True):
        rows.append(
            (
                curve.label,
                *_path(curve),
                shown(curve.mean_absolute_error, "error_pa", 2),
                shown(error_pa, "error_pa", 2),
                _ended(curve),
            )
        )
    return columns(("curve", "C_d A", "b", "a", "m", "MAE", "MAE, rig", ""), rows)


def _path(curve: TankCurve) -> tuple[str, ...]:
    """Area and shape of the path of a curve; one that carries no flow shows no shape."""
    if curve.shut:
        return ("shut", *("-" for _ in curve.shape))
    shape = (f"{each.value:.4f} +- {each.deviation:.4f}" for each in curve.shape.values())
    return (shown(curve.area_m2.value, "area_m2"), *shape)


def _ended(curve: TankCurve) -> str:
    """Which of b, a and m ended at the end of its range."""
    ended = [word for word, each in curve.shape.items() if each.name in curve.at_bound]
    return f"{', '.join(ended)} at a bound" if ended else ""


def _measured(found: Identified) -> str:
    """A name with the unit of what the curves hold."""
    return "error_n" if hasattr(found, "break_aways") else "error_pa"


def _row(each: Estimate, had: str, procedure: Procedure, remark: str = "") -> tuple[str, ...]:
    spread = shown(each.deviation, each.name, 2) if isfinite(each.deviation) else "-"
    printed = shown(procedure.printed.get(each.name, nan), each.name)
    return public_name(each.name), shown(each.value, each.name), spread, had, printed, remark

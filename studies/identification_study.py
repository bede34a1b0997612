"""Study ``identification``: the procedures of paper 002 against what was put into the truth.

The claims are what the paper says of its own numbers, or what its spread allows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from pathlib import Path

from studies.figures.identification import identification_figures
from studies.figures.identification_chain import chain_figure
from studies.identification import Answer, answers, flow_table, recordings, table, write_files
from studies.identification_chain import TABLE_7, Step, chain, chain_text, sine
from studies.papers.drive_overlays import (
    overlay_claims,
    overlay_figure,
    overlay_findings,
    overlays,
)
from studies.papers.findings import Finding, findings_text
from studies.study import Claim, Extent, Outcome, Study
from workbench.plants.servo_drive import BRISTLE_DAMPING_N_S_M, BRISTLE_STIFFNESS_N_M

CLAIMED_V = ((1.0, 4.5), (5.5, 10.0))  # where the paper's tank curves fit
LARGEST_ERROR_PA = 4e3
CLOSE_V = 0.02
POSITION = "slide.position_m"
LEAST_FALL = 0.9  # of the position's error on the drive
RULE = (
    "least_bristle_stiffness_n_m",
    "largest_bristle_stiffness_n_m",
    "largest_bristle_damping_n_s_m",
)
CLOSE = {"wall-heat": 0.05, "dead-volume": 0.02, "friction": 0.05}  # relative


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """Record, identify, and compare; the recordings stay in the folder with rigs that read them."""
    say("recordings of the truth")
    data, held_out = recordings(), sine()
    write_files({**data, "held out": [held_out]}, folder / "recordings")
    say("identification")
    found = answers(data)
    say("free runs on a recording that no procedure saw")
    steps = chain(found, held_out)
    figures = {
        name: figure
        for answer in found.values()
        for name, figure in identification_figures(answer.found).items()
    }
    names, errors = [step.name for step in steps], [step.errors for step in steps]
    figures["chain"] = chain_figure(names, errors, TABLE_7)
    say("sines on the tank and on the drive")
    seen = overlays(steps[-1].rig, found["flow"].found.improved())
    figures["overlays"] = overlay_figure(seen)
    findings = [*_bristle(found), *overlay_findings(seen)]
    parts = (table(found), flow_table(found["flow"]), chain_text(steps), findings_text(findings))
    numbers = {
        "found": _numbers(found),
        "chain": dict(zip(names, errors, strict=True)),
        "findings": [asdict(each) for each in findings],
    }
    claims = (*_claims(found), *_claims_of_chain(steps), *overlay_claims(seen))
    return Outcome("\n\n".join(parts), claims, figures, numbers)


def _bristle(found: Mapping[str, Answer]) -> Iterator[Finding]:
    """S002-6: the rule, from the forces that were identified."""
    least, most, damping = (found["friction"].found[name].value for name in RULE)
    told = f"{1e-6 * least:.2f} to {1e-6 * most:.1f} MN/m"
    why = "F_c over 50 to 1 um, with the forces found here"
    yield Finding("S002-6", "stiffness of the bristle", "1.12 MN/m", told, why)
    why = "sigma_2 / (F_s / F_c - 1); the paper prints the unit N/m (E002-13)"
    yield Finding("S002-6", "its damping", "50", f"up to {damping:.1f} N s/m", why)


def _claims_of_chain(steps: list[Step]) -> Iterator[Claim]:
    first, last = steps[0].errors, steps[-1].errors
    fall = 1.0 - last[POSITION] / first[POSITION]
    claim = f"position error of the drive's free run falls by {LEAST_FALL:.0%}"
    yield Claim(claim, f"{fall:.0%}", fall >= LEAST_FALL)
    share = max(last[name] / value for name, value in TABLE_7.items() if name != POSITION)
    yield Claim("its pressure errors below paper 002, Table 7", f"{share:.0%} of it", share <= 1.0)


def _claims(found: Mapping[str, Answer]) -> Iterator[Claim]:
    limits = found["dead-zone"]
    off_v = max(
        abs(each.value - limits.true[each.name])
        for each in limits.found.estimates
        if each.name.endswith("limit_v")
    )
    yield Claim(f"limits of the dead zone within {CLOSE_V:g} V", f"{off_v:.2g} V", off_v <= CLOSE_V)
    for name, most in CLOSE.items():
        off = max(_relative(found[name]).values())
        yield Claim(f"{name} within {most:.0%}", f"{off:.1%}", off <= most)
    least, most, damping = (found["friction"].found[name].value for name in RULE)
    fits = least <= BRISTLE_STIFFNESS_N_M <= most and damping >= BRISTLE_DAMPING_N_S_M
    told = f"{1e-6 * least:.2f} to {1e-6 * most:.1f} MN/m, up to {damping:.1f} N s/m"
    yield Claim("S002-6: 1.12 MN/m and 50 N s/m keep the rule of the bristle", told, fits)
    flow = found["flow"].found
    worst = max(
        curve.mean_absolute_error
        for curve in flow.curves
        if any(low <= curve.command_v <= high for low, high in CLAIMED_V)
    )
    told = f"{1e-5 * worst:.2g} bar"
    yield Claim("tank curves within 0.04 bar", told, worst <= LARGEST_ERROR_PA)


def _relative(answer: Answer) -> dict[str, float]:
    """Relative error of every number that the truth has."""
    both = (*answer.found.estimates, *answer.found.parameters)
    return {
        each.name: abs(each.value / answer.true[each.name] - 1.0)
        for each in both
        if each.name in answer.true
    }


def _numbers(found: Mapping[str, Answer]) -> dict[str, dict[str, float]]:
    """Identified values in SI by procedure and name."""
    return {
        name: {e.name: e.value for e in (*answer.found.estimates, *answer.found.parameters)}
        for name, answer in found.items()
    }


STUDY = Study(
    name="identification",
    question="do the identification procedures of paper 002 find what was put into the truth?",
    source="paper 002 sections 4 and 5",
    run=run,
    rows=tuple(f"S002-{k}" for k in (1, 2, 3, 4, 5, 6, 7, 9, 10, 11)),
    plants=("servo_drive", "servo_reservoir"),
    seeds="1 to 8, one for each recording",
)

"""Study ``identification``: the procedures of paper 002 against what was put into the truth.

The claims are what the paper says of its own numbers, or what its spread allows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from studies.figures.identification import identification_figures
from studies.identification import Answer, answers, flow_table, recordings, table, write_files
from studies.study import Claim, Extent, Outcome, Study

CLAIMED_V = ((1.0, 4.5), (5.5, 10.0))  # where the paper's tank curves fit
LARGEST_ERROR_PA = 4e3
CLOSE_V = 0.02
CLOSE = {"wall-heat": 0.05, "dead-volume": 0.02, "friction": 0.05}  # relative


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """Record, identify, and compare; the recordings stay in the folder with rigs that read them."""
    say("recordings of the truth")
    data = recordings()
    write_files(data, folder / "recordings")
    say("identification")
    found = answers(data)
    figures = {
        name: figure
        for answer in found.values()
        for name, figure in identification_figures(answer.found).items()
    }
    text = f"{table(found)}\n\n{flow_table(found['flow'])}"
    return Outcome(text, tuple(_claims(found)), figures, {"found": _numbers(found)})


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
    source="paper 002, S002-1 to S002-7",
    run=run,
)

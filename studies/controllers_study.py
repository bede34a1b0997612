"""Study ``controllers``: what the designs reach on drawn plants.

On the servo drive all of them, and feedback linearisation beside them, against published results;
on rig, arm, leg and soft joint the best one against what is asked of it, see
:mod:`studies.followers`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from studies.followers import (
    Runs,
    follower_claims,
    follower_numbers,
    follower_runs,
    follower_text,
    labelled_shares,
)
from studies.kept import Kept
from studies.study import Claim, Extent, Outcome, Study
from studies.text import columns, number
from studies.versions import work_folder
from studies.yardsticks import (
    LATE_S,
    LIMITS,
    PAYLOADS_KG,
    Draw,
    draw_of,
    draws,
    figures_of,
    late,
    measured,
    told_apart,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DRAWS = {Extent.QUICK: 3, Extent.FULL: 30}
DESIGNS: dict[str, tuple[str, Mapping[str, Any]]] = {
    "cascade": ("cascade", {}),
    "lq": (
        "lq",
        {
            "sample_time_s": 1e-3,
            "position_m": 0.7e-3,
            "velocity_m_s": 0.06,
            "positioning": {
                "approach_m": 0.012,
                "band_m": 2.2e-5,
                "leave_m": 5e-5,
                "stribeck_share": 1.0,
                "turn_per_s": 100.0,
                "standing_per_s": 12.5,
                "turn_m_s": 0.005,
            },
        },
    ),
    "pid": ("pid", {}),
    "mpc": ("mpc", {}),
    "nonlinear-mpc": ("nonlinear-mpc", {}),
    "feedback-linearisation": ("feedback-linearisation", {}),
}
"""Method and numbers of each design, the first being the one that is to hold."""
SPREAD = 95.0  # per cent of the draws within twice the limit
Rows = Mapping[tuple[str, float], Sequence[Mapping[str, float]]]
"""The numbers of all draws by design and payload."""


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """Every design with every payload, draw by draw; a second start goes on."""
    kept, rows = Kept(work_folder(folder) / "rows.jsonl"), {}
    for name, (method, numbers) in DESIGNS.items():
        for draw in map(late, draws(DRAWS[extent])):
            key = f"{name} {draw.payload_kg:g} {draw.number}"
            if key not in kept:
                say(f"{name} with {draw.payload_kg:g} kg, draw {draw.number + 1}")
                kept.add(key, {"found": _measured(draw, method, numbers)})
            rows.setdefault((name, draw.payload_kg), []).append(kept.rows[key]["found"])
    return together(outcome(rows), follower_runs(kept, DRAWS[extent], say))


def together(drive: Outcome, found: Runs) -> Outcome:
    """What came out on the drive, and on the other plants."""
    from studies.figures.followers import follower_figure

    return Outcome(
        f"{drive.text}\n\n{follower_text(found)}",
        (*drive.claims, *follower_claims(found)),
        {**drive.figures, "followers": follower_figure(labelled_shares(found))},
        {**drive.numbers, **follower_numbers(found)},
    )


def outcome(rows: Rows) -> Outcome:
    """Text, claims, figure and numbers of all runs."""
    from studies.figures.yardsticks import yardstick_figure

    numbers = {
        name: {
            f"{kg:g} kg": {mark: _summary(found, mark) for mark in LIMITS}
            for (design, kg), found in rows.items()
            if design == name
        }
        for name in DESIGNS
    }
    figures: dict[str, Figure] = {"yardsticks": yardstick_figure(rows, LIMITS)}
    return Outcome(_text(rows), (*_claims(rows),), figures, numbers)


def _measured(draw: Draw, method: str, numbers: Mapping[str, Any]) -> dict[str, float | None]:
    """The numbers of one draw; None stands for NaN, which JSON does not know."""
    found = measured(draw, method, numbers)
    return {mark: value if np.isfinite(value) else None for mark, value in found.items()}


def _summary(found: Sequence[Mapping[str, float]], mark: str) -> dict[str, float]:
    values = figures_of(found, mark)
    return {"median": float(np.median(values)), "spread": _spread(values)}


def _spread(values: np.ndarray) -> float:
    return float(np.percentile(values, SPREAD, method="higher"))


def _claims(rows: Rows) -> Iterator[Claim]:
    best = next(iter(DESIGNS))
    for mark, limit in LIMITS.items():
        medians, spreads = [], []
        for kg in PAYLOADS_KG:
            values = figures_of(rows[best, kg], mark)
            medians.append(float(np.median(values)))
            spreads.append(_spread(values))
        told = f"medians {', '.join(number(m, 3) for m in medians)}; 95 % {number(max(spreads), 3)}"
        holds = max(medians) <= limit and max(spreads) <= 2.0 * limit
        yield Claim(f"{best}, every payload, {mark}: {limit:g} at most", told, holds)
    lost = [
        f"{name} with {kg:g} kg, draw {k + 1}: {told_apart(draw_of(k, kg))}"
        for (name, kg), found in rows.items()
        for k, row in enumerate(found)
        if name == best and None in row.values()
    ]
    yield Claim(f"{best}: no draw is unstable", "; ".join(lost) or "none", not lost)


def _text(rows: Rows) -> str:
    head = ("design", "payload kg", *LIMITS)
    lines = [
        (
            name,
            f"{kg:g}",
            *(
                f"{number(float(np.median(v)), 3)} ({number(_spread(v), 3)})"
                for v in (figures_of(found, mark) for mark in LIMITS)
            ),
        )
        for (name, kg), found in rows.items()
    ]
    limits = ("limit", "-", *(f"{limit:g}" for limit in LIMITS.values()))
    draws_run = len(next(iter(rows.values())))
    told = f"median over {draws_run} draws of the parameters, in brackets 95 % of them; sensors "
    told += f"with noise, commands of 12 bits that come {1e3 * LATE_S:g} ms late"
    return f"{columns(head, [limits, *lines])}\n{told}"


STUDY = Study(
    name="controllers",
    question="which designs position and follow as asked, on plants that they do not know?",
    source="Zhu and Barth 2010; Bone and Ning 2007; papers 000, 001 and 004; physics.md 2",
    run=run,
    plants=("servo_drive", "crr_rig", "crr_arm", "crr_leg", "soft_joint"),
    seeds="draw k, from 0: 1001 + k",
)

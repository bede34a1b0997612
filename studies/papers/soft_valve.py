"""Study ``soft-valve``: the electrical and the spool side of paper 004's valve.

S004-1   PWM to coil current: a straight line with R^2 = 0.997 (Fig. 6); what the scatter that this
         leaves means for the bellows
S004-2   area over command: smax in place of the data sheet's curve (Fig. 5); what its roundness,
         a length that the paper does not print (E004-6), costs in fit and in tightness

The line, the spool's edges and the volume are *chosen* (physics.md 2.6).  The data sheet is not
printed: sharp edges with an overlap of 2 % stand for it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np

from studies.figures.panels import Line, Panel, panels_figure
from studies.figures.style import BLACK, BLUE, GREEN, ORANGE, PAGE_IN, RED
from studies.papers.findings import Finding, outcome
from studies.soft_joint_fits import PSI_PA
from studies.study import Claim, Extent, Outcome, Study
from studies.text import columns
from workbench.effects import ThreePortValve
from workbench.identification.least_squares import Unknown, solve
from workbench.plant import Plant
from workbench.plants.soft_joint import (
    ATMOSPHERE_PA,
    COMMAND,
    NEUTRAL,
    OVERLAP,
    PRESSURE,
    SUPPLY_PA,
    soft_joint,
)
from workbench.recording import Recording
from workbench.simulation import simulate
from workbench.spool import SharpOpening, SmoothOpening

R_SQUARED, FULL_A, COIL_SPREAD = 0.997, 1.0, 0.304 / 3.8  # printed
LEVELS = 21
RECORDS = {Extent.QUICK: 200, Extent.FULL: 5000}
COMMANDS = (0.55, 0.6, 0.7, 1.0)
CORNERS = (0.002, 0.005, 0.01, 0.02, 0.04)
CHOSEN = 0.01
STEP_S = 2.5e-3
SHEET = np.linspace(0.0, 1.0, 21)  # commands at which one reads a printed curve
HOLD_S, HELD_PA = 5.0, 40 * PSI_PA + ATMOSPHERE_PA


def scatter() -> float:
    """Standard deviation of the command, of its range, that leaves R^2 = 0.997 over all levels."""
    command = np.linspace(0.0, 1.0, LEVELS)
    return float(np.sqrt((1 / R_SQUARED - 1) * command.var()))


def lines(number: int) -> np.ndarray:
    """Recorded lines of PWM to current in A, fitted: slope over 2 A, neutral, R^2; (3, number)."""
    pwm = np.linspace(0.0, 1.0, LEVELS)
    noise = np.random.default_rng(1).standard_normal((LEVELS, number))
    current = FULL_A * (2.0 * (pwm[:, None] - NEUTRAL) + 2.0 * scatter() * noise)
    slope, level = np.polyfit(pwm, current, 1)
    left = current - (slope * pwm[:, None] + level)
    determined = 1.0 - left.var(axis=0) / current.var(axis=0)
    return np.array([slope / (2.0 * FULL_A), -level / slope, determined])


def pressure_pa(plant: Plant, command: float, start_pa: float, duration_s: float) -> np.ndarray:
    """The bellows under a constant command, shape (n,)."""
    sent = np.full(round(duration_s / STEP_S) + 1, command)
    recording = Recording("hold", STEP_S, {COMMAND: sent})
    return simulate(plant, recording, np.array([start_pa]))[PRESSURE]


def fill_s(plant: Plant, command: float) -> float:
    """Time to 95 % of the way from ambient to the supply; nan where it takes more than 8 s."""
    risen = pressure_pa(plant, command, ATMOSPHERE_PA, 8.0) - ATMOSPHERE_PA
    there = risen > 0.95 * (SUPPLY_PA - ATMOSPHERE_PA)
    return STEP_S * int(np.argmax(there)) if there.any() else float("nan")


@dataclass(frozen=True)
class Corner:
    """One roundness of smax against sharp edges.

    worst, rms    error of the area, of the full one, over the commands read, overlap fitted
    leak_m2       area of each path at the neutral command
    creep_pa_s    how fast the bellows rises at it, from 40 psi
    """

    share: float
    overlap: float
    worst: float
    rms: float
    leak_m2: float
    creep_pa_s: float


def area_shares(opening: object, overlap: float, corner: float) -> tuple[np.ndarray, np.ndarray]:
    """Fill and vent shares over the commands of the data sheet."""
    span = NEUTRAL - overlap
    both = []
    for side in (1.0, -1.0):
        travel = ca.DM(side * (SHEET - NEUTRAL) - overlap)
        both.append(ca.DM(opening(travel, span, corner)).full().ravel())
    return both[0], both[1]


def corner(share: float) -> Corner:
    """The overlap that fits best with this roundness, and what it leaves."""
    sharp = np.hstack(area_shares(SharpOpening(), OVERLAP, share))

    def off(unknown: np.ndarray) -> np.ndarray:
        return np.hstack(area_shares(SmoothOpening(), float(unknown[0]), share)) - sharp

    found = solve(off, [Unknown(OVERLAP, 0.01, 0.0, 0.2)], noise=1e-4)
    overlap = float(found.values[0])
    values = {"valve.corner_share": share, "valve.overlap_share": overlap}
    plant = soft_joint().lean().with_values(values)
    risen = pressure_pa(plant, NEUTRAL, HELD_PA, HOLD_S)
    valve = next(e for e in plant.effects if isinstance(e, ThreePortValve))
    neutral = area_shares(SmoothOpening(), overlap, share)[0][np.argmin(np.abs(SHEET - NEUTRAL))]
    left = found.residuals
    return Corner(
        share=share,
        overlap=overlap,
        worst=float(np.abs(left).max()),
        rms=float(np.sqrt(np.mean(left**2))),
        leak_m2=float(neutral * valve.flow_area_m2),
        creep_pa_s=float(risen[-1] - risen[0]) / HOLD_S,
    )


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """Lines, fill times, corners; nothing is kept."""
    say("lines of the current, and what their scatter does")
    fitted, plant = lines(RECORDS[extent]), soft_joint().lean()
    off = scatter()
    times = {
        command: [
            fill_s(plant, each)
            for each in (
                command,
                command - off,
                min(command + off, 1.0),
                NEUTRAL + (command - NEUTRAL) * (1 - COIL_SPREAD),
            )
        ]
        for command in COMMANDS
    }
    say("roundness of the spool's edges")
    corners = [corner(share) for share in CORNERS]
    tables = [_time_table(times), _corner_table(corners)]
    found = [*_findings(fitted, times), *_spool_findings(corners)]
    claims = [*_claims(fitted, times), *_spool_claims(corners)]
    figures = {"valve": _figure(corners)}
    return outcome(found, claims, figures, tables)


def _time_table(times: Mapping[float, list[float]]) -> str:
    rows = [(f"{c:g}", *(f"{1e3 * t:.0f}" for t in each)) for c, each in times.items()]
    head = ("command", "fill ms", "a deviation less", "a deviation more", "coil 8 % weaker")
    return columns(head, rows)


def _corner_table(corners: list[Corner]) -> str:
    rows = [
        (
            f"{each.share:g}",
            f"{each.overlap:.4f}",
            f"{each.worst:.2%}",
            f"{each.rms:.2%}",
            f"{1e6 * each.leak_m2:.3f}",
            f"{each.creep_pa_s / PSI_PA:.2f}",
        )
        for each in corners
    ]
    head = ("corner", "overlap", "area, worst", "RMS", "open at 0.5, mm2", "rises psi/s")
    return columns(head, rows)


def _findings(fitted: np.ndarray, times: Mapping[float, list[float]]) -> Iterator[Finding]:
    why = "the scatter is chosen so that R^2 is the printed one: 1.6 % of the command's range"
    yield Finding("S004-1", "R^2 of the line", "0.997", f"{np.median(fitted[2]):.4f}", why)
    slope, neutral = (float(row.std()) for row in fitted[:2])
    yield Finding("S004-1", "slope and neutral known to", "-",
                  f"{slope:.1%}, {neutral:.2%} of the range")  # fmt: skip
    plain, less, more, _ = times[0.55]
    told = f"{1e3 * more:.0f} to {1e3 * less:.0f} ms, straight {1e3 * plain:.0f}"
    yield Finding("S004-1", "fill at 0.55, one deviation off", "-", told)


def _spool_findings(corners: list[Corner]) -> Iterator[Finding]:
    chosen = next(each for each in corners if each.share == CHOSEN)
    why = (
        "the data sheet is not printed and its length scale neither: sharp edges stand for it, "
        "read at 21 commands"
    )
    told = f"RMS {chosen.rms:.2%}, worst {chosen.worst:.2%}"
    yield Finding("S004-2", "smax against the curve, corner 0.01", "a fit", told, why)
    why = "smax never shuts (E004-6)"
    told = f"{1e6 * chosen.leak_m2:.2f} mm2, rises {chosen.creep_pa_s / PSI_PA:.1f} psi/s"
    yield Finding("S004-2", "each path at the neutral command", "-", told, why)


def _claims(fitted: np.ndarray, times: Mapping[float, list[float]]) -> Iterator[Claim]:
    low, high = np.percentile(fitted[2], (5, 95))
    claim = "S004-1: lines with a scatter of 1.6 % of the range have the printed R^2"
    yield Claim(claim, f"{low:.4f} to {high:.4f}", low < R_SQUARED < high)
    neutral = 2 * float(fitted[1].std())
    claim = "S004-1: the line tells the neutral command to less than half of the spool's overlap"
    yield Claim(claim, f"{neutral:.2%} of {OVERLAP:.0%}, two deviations", neutral < OVERLAP / 2)
    spread = {c: (less - more) / plain for c, (plain, less, more, _) in times.items()}
    told = ", ".join(f"{share:.0%} at {c:g}" for c, share in spread.items())
    claim = "S004-1: near the neutral command that scatter changes a fill by half and more"
    yield Claim(claim, told, spread[0.55] > 0.5 and spread[0.55] > spread[0.7])


def _spool_claims(corners: list[Corner]) -> Iterator[Claim]:
    chosen = next(each for each in corners if each.share == CHOSEN)
    yield Claim("S004-2: with a corner of 0.01 smax is within 1 % of the full area everywhere",
                f"{chosen.worst:.2%}", chosen.worst < 0.01)  # fmt: skip
    fits = np.array([each.rms for each in corners])
    creeps = np.array([each.creep_pa_s for each in corners])
    claim = "S004-2: the rounder the worse the fit and the faster the bellows rises at neutral"
    told = ", ".join(f"{each / PSI_PA:.2g}" for each in creeps)
    grows = bool((np.diff(fits) > 0).all() and (np.diff(creeps) > 0).all())
    yield Claim(claim, f"{told} psi/s", grows)


def _figure(corners: list[Corner]):
    fill, vent = area_shares(SharpOpening(), OVERLAP, CHOSEN)
    lines_left = [
        Line(100 * SHEET, 100 * fill, "sharp edges, fill", "o", BLACK),
        Line(100 * SHEET, 100 * vent, "sharp edges, vent", "s", GREEN),
    ]
    for share, style, colour in ((CHOSEN, "-", BLUE), (0.04, "--", RED)):
        each = next(c for c in corners if c.share == share)
        for k, part in enumerate(area_shares(SmoothOpening(), each.overlap, share)):
            label = f"smax, corner {share:g}" if k == 0 else ""
            lines_left.append(Line(100 * SHEET, 100 * part, label, style, colour))
    left = Panel("command (%)", "area (%)", lines_left)
    share = np.array([each.share for each in corners])
    right = Panel(
        "corner, share of the command's range (-)",
        "rise at the neutral command (psi/s)",
        [
            Line(share, np.array([each.creep_pa_s for each in corners]) / PSI_PA, "", "-", ORANGE),
            Line(share, np.array([each.creep_pa_s for each in corners]) / PSI_PA, "", "o", ORANGE),
        ],
        logarithmic="y",
        x_range=(0.0, 0.042),
    )
    return panels_figure([[left, right]], PAGE_IN, 2.8, legend_columns=4)


STUDY = Study(
    name="soft-valve",
    question="what do the scatter of the current and the round edge of smax mean for the bellows?",
    source="paper 004 Figs. 5, 6",
    run=run,
    rows=("S004-1", "S004-2"),
    plants=("soft_joint",),
    seeds="of the currents 1",
)

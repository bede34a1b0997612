"""Study ``delays``: what late commands and pausing packets do to a loop, and what margins foretell.

Paper 001 loses its joint when the screen is redrawn ten times a second, and tunes anew for every
frequency.  Here each design positions the servo drive while the commands arrive later than it
knows, or while all packets stop for 20 ms at every redraw.  Beside that stands the delay margin of
its linear modes, taken at the real sample time.  The drive is drawn as in study ``controllers``,
5.8 kg; nothing is tuned anew.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from controllers.design_file import Design, design
from controllers.margins import margins
from studies.closed_loop_check import standard_estimator
from studies.controllers_study import DESIGNS
from studies.draws import kept_rows
from studies.kept import Row
from studies.study import Claim, Extent, Outcome, Study
from studies.text import columns, number
from studies.yardsticks import PAYLOAD_KG, Closed, Draw, draw_of, medians, sine, step
from workbench.effects.timing import PacketPause
from workbench.plant import Plant

DRAWS = {Extent.QUICK: 3, Extent.FULL: 20}
COMPARED = ("lq", "pid")
DELAYS_MS = (0.0, 2.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0)
REDRAWS_HZ = (1.0, 10.0)
COMMAND = "valve.command_v"
CYCLE, TRACKING = "motion at rest (mm)", "60 mm at 0.5 Hz: RMSE (mm)"
JUDGED = (CYCLE, TRACKING)
SAFE, BEYOND = 0.5, 1.5  # of the smallest and of the largest delay margin
RESTS_MM, CYCLES_MM = 0.1, 1.0
"""A loop rests below the first, as in ``controllers``; above the second it plainly does not."""


@dataclass(frozen=True)
class Late:
    """One design with one draw: commands so late, or so many redraws a second."""

    design: str
    number: int
    delay_ms: float = 0.0
    redraw_hz: float = 0.0

    @property
    def key(self) -> str:
        return f"{self.design} {self.number} {self.delay_ms:g} ms {self.redraw_hz:g} Hz"


@lru_cache(maxsize=2)
def _designed(name: str, number: int) -> tuple[Draw, Design]:
    """A draw and the design on what is believed of it."""
    draw = draw_of(number, PAYLOAD_KG)
    method, numbers = DESIGNS[name]
    return draw, design(method, draw.believed, numbers)


def worked(piece: Late) -> Row:
    """Motion at rest after a step and tracking error of a sine; None where the loop was lost."""
    draw, made = _designed(piece.design, piece.number)
    controller = made.controller
    estimator = standard_estimator("ekf", draw.believed, controller.sample_time_s)
    truth = _late(draw.plant, piece).lean()
    loop = Closed(truth, controller, estimator, piece.number)
    try:
        found = {
            CYCLE: 1e3 * loop.metrics(step(truth)).limit_cycle_m,
            TRACKING: 1e3 * loop.metrics(sine(truth, 0.5, 0.06)).rmse_m,
        }
    except ArithmeticError:
        found = {}
    return {"found": {name: found.get(name) for name in JUDGED}, "margins_ms": _margins_ms(made)}


def _late(plant: Plant, piece: Late) -> Plant:
    plant = plant.with_values({"command_delay.delay_s": 1e-3 * piece.delay_ms})
    if not piece.redraw_hz:
        return plant
    signals = (COMMAND, *plant.measured)
    return plant.with_effects(PacketPause(name="pause", signals=signals, redraw_hz=piece.redraw_hz))


def _margins_ms(made: Design) -> list[float]:
    """Delay margins of all modes that are stable; none for a law of another kind."""
    laws = getattr(made.controller, "laws", None)
    if laws is None:
        return []
    found = margins(made.hybrid, laws, made.controller.sample_time_s)
    return [1e3 * each.delay_s for each in found if each.stable]


def pieces(number: int) -> Iterator[Late]:
    """Everything that is asked of so many draws."""
    for k in range(number):
        for name in COMPARED:
            yield from (Late(name, k, delay_ms=delay) for delay in DELAYS_MS)
            yield from (Late(name, k, redraw_hz=redraw) for redraw in REDRAWS_HZ)


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """Every delay and redraw with every draw; what is kept in the folder is not done again."""
    asked = {piece.key: piece for piece in pieces(DRAWS[extent])}
    return outcome([*asked.values()], kept_rows(folder, worked, asked, say))


def outcome(asked: Sequence[Late], rows: Sequence[Mapping[str, Any]]) -> Outcome:
    """Table, claims, figure and numbers of all loops."""
    from studies.figures.delays import delay_figure

    found: dict[tuple[str, float, float], dict[str, float]] = {}
    margin = {name: _range_ms(asked, rows, name) for name in COMPARED}
    for name, delay, redraw in dict.fromkeys((p.design, p.delay_ms, p.redraw_hz) for p in asked):
        same = [
            row["found"]
            for p, row in zip(asked, rows, strict=True)
            if (p.design, p.delay_ms, p.redraw_hz) == (name, delay, redraw)
        ]
        found[name, delay, redraw] = medians(same, JUDGED)
    numbers = {f"{n} {d:g} ms {r:g} Hz": v for (n, d, r), v in found.items()}
    curves = {
        name: {mark: [found[name, d, 0.0][mark] for d in DELAYS_MS] for mark in JUDGED}
        for name in COMPARED
    }
    figures = {"delays": delay_figure(DELAYS_MS, curves, margin)}
    text = _text(found, margin, len({p.number for p in asked}))
    return Outcome(text, (*_claims(found, margin),), figures, {"medians": numbers})


def _range_ms(
    asked: Sequence[Late], rows: Sequence[Mapping[str, Any]], name: str
) -> tuple[float, float]:
    """Smallest and largest delay margin of a design's modes; NaN where it has none."""
    of_all = [row["margins_ms"] for p, row in zip(asked, rows, strict=True) if p.design == name]
    known = [margin for of_one in of_all for margin in of_one]
    return (min(known), max(known)) if known else (np.nan, np.nan)


def _text(
    found: Mapping[tuple[str, float, float], Mapping[str, float]],
    margin: Mapping[str, tuple[float, float]],
    count: int,
) -> str:
    head = ("design", "commands late by", "redraws", *JUDGED)
    lines = [
        (name, f"{delay:g} ms", f"{redraw:g} Hz" if redraw else "none",
         *(number(values[mark], 3) for mark in JUDGED))
        for (name, delay, redraw), values in found.items()
    ]  # fmt: skip
    told = [
        f"delay margins of the modes of {name}: {number(low, 3)} to {number(high, 3)} ms"
        for name, (low, high) in margin.items()
        if np.isfinite(low)
    ]
    medians = f"medians over {count} draws with {PAYLOAD_KG:g} kg"
    return "\n".join([columns(head, lines), medians, *told])


def _claims(
    found: Mapping[tuple[str, float, float], Mapping[str, float]],
    margin: Mapping[str, tuple[float, float]],
) -> Iterator[Claim]:
    name = COMPARED[0]
    low, high = margin[name]
    cycles = {delay: found[name, delay, 0.0][CYCLE] for delay in DELAYS_MS}
    safe = max((c for delay, c in cycles.items() if delay <= SAFE * low), default=np.nan)
    lost = min((c for delay, c in cycles.items() if delay >= BEYOND * high), default=np.nan)
    yield Claim(
        f"{name} rests ({RESTS_MM:g} mm) with delays to {SAFE:.0%} of its smallest margin",
        f"{number(safe, 3)} mm at most", safe < RESTS_MM)  # fmt: skip
    yield Claim(
        f"{name} does not rest ({CYCLES_MM:g} mm) from {BEYOND:g} times its largest margin on",
        f"{number(lost, 3)} mm at least", lost > CYCLES_MM)  # fmt: skip
    for each in COMPARED:
        calm, late, early = (found[each, 0.0, hz][TRACKING] for hz in (0.0, 10.0, 1.0))
        yield Claim(
            f"{each}: redraws at 10 Hz cost more than at 1 Hz (paper 001: works at 1, fails at 10)",
            f"{number(calm, 3)} mm without, {number(early, 3)} at 1 Hz, {number(late, 3)} at 10",
            calm < early < late)  # fmt: skip


STUDY = Study(
    name="delays",
    question="how late may commands come, and how often may packets pause?",
    source="paper 001 Figs. 12 to 14 (S001-6, S001-7), asked of paper 002's drive",
    run=run,
    plants=("servo_drive",),
    seeds="draw k, from 0: 1001 + k",
)

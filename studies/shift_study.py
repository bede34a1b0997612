"""Study ``low-to-neutral``: what explains the gap of paper 003's state-space model.

Every combination of four repairs is run under the plant's own flows: corrected signs, dry friction
as an offset, the detent, and six operating points along the way in place of one.  The share of a
repair is the mean, over all orders in which the four can be made, of what it takes off the error.

Source: S003-3 of physics.md section 5; Shapley 1953, "A value for n-person games", for the shares.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations, permutations
from pathlib import Path

import numpy as np

from linearize.shifting import COULOMB, DETENT, Omission
from studies import low_to_neutral as runs
from studies.figures.shift import shift_figure
from studies.low_to_neutral import START, STEP_S, Shift, X
from studies.study import Claim, Extent, Outcome, Study

SIGNS, POINTS = "corrected signs", "six points"
KEPT: dict[str, Omission] = {"dry friction": COULOMB, "detent": DETENT}
REPAIRS = (SIGNS, *KEPT, POINTS)
PAPER = "as printed, one point"
TOLD = "corrected signs, one point"
OURS = "corrected signs, dry friction, detent, six points"
SEEN_S = 10e-3
CLOSE, FAR = 0.05, 0.20

Repairs = frozenset[str]


@dataclass(frozen=True)
class Row:
    """One model beside the plant, up to the plant's arrival at Neutral.

    started_s, arrived_s    0.1 mm from Low, and at Neutral; nan where it never is
    at_10_ms                pressures of chambers 1 and 2 then, Pa
    rmse, worst             of p1, p2 in Pa, x in m, v in m/s: root mean square and largest error
    share                   largest error of p1, p2 and x over the range of the plant's own
    """

    name: str
    started_s: float
    arrived_s: float
    at_10_ms: tuple[float, float]
    rmse: np.ndarray
    worst: np.ndarray
    share: np.ndarray


def measured(name: str, states: np.ndarray, seen: Shift) -> Row:
    """What is read off one run, states of shape (4, n + 1)."""
    upto = seen.arrival + 1
    own = seen.states[:, :upto]
    error = np.abs(states[:, :upto] - own)
    worst = error.max(axis=1)
    return Row(
        name=name,
        started_s=_first_s(states[X] >= START + runs.MOVED_M),
        arrived_s=_first_s(states[X] >= 0.0),
        at_10_ms=tuple(float(p) for p in states[:X, round(SEEN_S / STEP_S)]),
        rmse=np.sqrt((error**2).mean(axis=1)),
        worst=worst,
        share=(worst / np.ptp(own, axis=1))[: X + 1],
    )


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """Simulate, feed the flows into every model, and share the gap out; nothing is kept."""
    say("the plant with its valves")
    seen = runs.shift()
    say("the same flows into the models")
    states = {
        "plant": seen.states,
        "plant under its flows": runs.fed(seen),
        "reduced, not linear": runs.nonlinear(runs.reduced(), seen),
        "reduced, dry friction": runs.nonlinear(runs.reduced(COULOMB), seen),
        "reduced, dry friction, detent": runs.nonlinear(runs.reduced(COULOMB, DETENT), seen),
    }
    gaps: dict[Repairs, float] = {}
    for made in _all_sets():
        found = repaired(made, seen)
        states[_named(made)] = found
        gaps[made] = float(measured("", found, seen).rmse[X])
    rows = {name: measured(name, found, seen) for name, found in states.items()}
    parts = shares(gaps)
    figure = shift_figure(seen, {name: states[name] for name in (TOLD, PAPER, OURS)}, parts)
    numbers = {
        "shares": parts,
        "rows": {name: _numbers(row) for name, row in rows.items()},
    }
    text = f"{_table(rows)}\n\n{_shares_text(gaps, parts)}"
    return Outcome(text, tuple(_claims(rows, parts)), {"low_to_neutral": figure}, numbers)


def repaired(made: Repairs, seen: Shift) -> np.ndarray:
    """The paper's linear model with some of the repairs, under the plant's flows; (4, n + 1)."""
    model = runs.reduced(*(KEPT[name] for name in KEPT if name in made))
    modes = runs.along(model, seen) if POINTS in made else runs.one_point(model)
    if SIGNS not in made:
        modes = runs.printed(model, modes)
    return runs.linear(model, modes, seen)


def shares(gaps: Mapping[Repairs, float]) -> dict[str, float]:
    """What each repair takes off the error, in m, as the mean over all orders of making them."""
    orders = list(permutations(REPAIRS))
    taken = dict.fromkeys(REPAIRS, 0.0)
    for order in orders:
        for k, name in enumerate(order):
            before, after = frozenset(order[:k]), frozenset(order[: k + 1])
            taken[name] += (gaps[before] - gaps[after]) / len(orders)
    return taken


def _all_sets() -> Iterator[Repairs]:
    for size in range(len(REPAIRS) + 1):
        yield from map(frozenset, combinations(REPAIRS, size))


def _named(made: Repairs) -> str:
    first = SIGNS if SIGNS in made else "as printed"
    last = POINTS if POINTS in made else "one point"
    return ", ".join((first, *(name for name in KEPT if name in made), last))


def _claims(rows: Mapping[str, Row], parts: Mapping[str, float]) -> Iterator[Claim]:
    plant, told, ours = (rows[name] for name in ("plant", TOLD, OURS))
    again = float(rows["plant under its flows"].share[X])
    claim = "the plant's flows move it as its valves do, within 1 %"
    yield Claim(claim, f"{again:.2%} of the way", again <= 0.01)
    claim = (
        "one operating point in mid travel starts earlier, arrives later, with less in chamber 1"
    )
    found = f"{_ms(told.started_s)}, {_ms(told.arrived_s)} ms, {_bar(told.at_10_ms[0])} bar"
    earlier, later = told.started_s < plant.started_s, told.arrived_s > plant.arrived_s
    yield Claim(claim, found, earlier and later and told.at_10_ms[0] < plant.at_10_ms[0])
    off = abs(told.at_10_ms[1] / plant.at_10_ms[1] - 1.0)
    yield Claim(
        "its pressure in chamber 2 is that of the plant, within 5 %", f"{off:.1%}", off < CLOSE
    )
    most = max(parts, key=lambda name: parts[name])
    claim = "signs and operating point explain more of the gap than dry friction"
    model_mm, dry_mm = (
        1e3 * part for part in (parts[SIGNS] + parts[POINTS], parts["dry friction"])
    )
    yield Claim(claim, f"{model_mm:.2f} against {dry_mm:.2f} mm; most: {most}", model_mm > dry_mm)
    paper = float(rows[PAPER].share.max())
    yield Claim(
        "the printed model misses the plant by a fifth or more", f"{paper:.0%}", paper >= FAR
    )
    worst = float(ours.share.max())
    claim = "our modes stay within 5 % of the plant in p1, p2 and x"
    yield Claim(claim, f"{worst:.1%}", worst <= CLOSE)


def _table(rows: Mapping[str, Row]) -> str:
    wide = max(map(len, rows)) + 2
    lines = [
        f"{'':<{wide}}{'starts':>8}{'arrives':>9}{'p1, p2 at 10 ms':>17}{'RMSE of x':>11}"
        f"{'p1':>8}{'worst x':>9}{'p1':>7}{'p2':>7}",
        f"{'':<{wide}}{'ms':>8}{'ms':>9}{'bar':>17}{'mm':>11}{'bar':>8}{'%':>9}{'%':>7}{'%':>7}",
    ]
    for name, row in rows.items():
        p1, p2 = map(_bar, row.at_10_ms)
        worst = 100.0 * row.share
        lines.append(
            f"{name:<{wide}}{_ms(row.started_s):>8}{_ms(row.arrived_s):>9}{f'{p1}, {p2}':>17}"
            f"{1e3 * row.rmse[X]:>11.3f}{1e-5 * row.rmse[0]:>8.3f}"
            f"{worst[X]:>9.1f}{worst[0]:>7.1f}{worst[1]:>7.1f}"
        )
    return "\n".join(lines)


def _shares_text(gaps: Mapping[Repairs, float], parts: Mapping[str, float]) -> str:
    none, every = gaps[frozenset()], gaps[frozenset(REPAIRS)]
    lines = [f"RMSE of x falls from {1e3 * none:.2f} to {1e3 * every:.2f} mm; of that take off"]
    for name, part in sorted(parts.items(), key=lambda item: -item[1]):
        alone = none - gaps[frozenset({name})]
        share = part / (none - every)
        lines.append(
            f"  {name:<16}{1e3 * part:6.2f} mm  {share:4.0%}   alone {1e3 * alone:5.2f} mm"
        )
    return "\n".join(lines)


def _numbers(row: Row) -> dict[str, object]:
    plain = {key: getattr(row, key) for key in ("started_s", "arrived_s", "at_10_ms")}
    lists = {key: getattr(row, key).tolist() for key in ("rmse", "worst", "share")}
    times = {k: None if v != v else v for k, v in plain.items()}  # no nan in JSON
    return {**times, **lists}


def _first_s(holds: np.ndarray) -> float:
    return STEP_S * int(np.argmax(holds)) if holds.any() else float("nan")


def _ms(time_s: float) -> str:
    return "never" if np.isnan(time_s) else f"{1e3 * time_s:.1f}"


def _bar(pressure_pa: float) -> str:
    return f"{1e-5 * pressure_pa:.2f}"


STUDY = Study(
    name="low-to-neutral",
    question="what explains the gap between paper 003's state-space model and its nonlinear one?",
    source="paper 003 Fig. 4, S003-3",
    run=run,
    rows=("S003-3",),
    plants=("gearbox",),
)

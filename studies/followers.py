"""Rig, arm, leg and soft joint under their best designs, on drawn plants: what `controllers` adds.

Design and estimator keep the nominal parameters.  The leg's packets pause for 20 ms every second,
as in paper 001; its estimator does not know.  No design was tuned on these draws.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from controllers.design_file import design
from studies.checking import apart, drawn
from studies.following import BENCHES, STEP
from studies.following_check import check_followed, tasks_of
from studies.kept import Kept
from studies.plain import plain
from studies.study import Claim
from studies.text import columns, shown
from studies.yardsticks import FIRST_SEED
from workbench.contracts import Controller
from workbench.errors import listed
from workbench.plant import Plant
from workbench.plants import PLANTS
from workbench.rig import default_rig
from workbench.units import suffix

PAUSES = {"crr_leg": {"packet_pause.redraw_hz": 1.0}}
"""What every drawn plant of a kind has on top."""

Run = Mapping[str, Mapping[str, Sequence[float | None]]]
"""By scenario and figure: what was found and what is asked at most; None for NaN and infinity."""
Runs = Mapping[str, Sequence[Run]]
"""The runs of all draws by plant; a draw that did not stay finite has no scenarios."""


def follower_runs(kept: Kept, number: int, say: Callable[[str], None]) -> Runs:
    """All tasks of every bench on so many drawn plants; what is kept is not run again."""
    found: dict[str, list[Run]] = {}
    for name, bench in BENCHES.items():
        plant = PLANTS[name]()
        for k in range(number):
            key = f"{name} {bench.best} {k}"
            if key not in kept:
                say(f"{name} with {bench.best}, draw {k + 1}")
                kept.add(key, {"found": _run(plant, bench.best, k)})
            found.setdefault(name, []).append(kept.rows[key]["found"])
    return found


def drawn_plant(plant: Plant, number: int) -> Plant:
    """The plant of a draw, the same at every call."""
    rng = np.random.default_rng(FIRST_SEED + number)
    pauses = PAUSES.get(plant.name, {})  # there before the draw, so that their lengths are drawn
    rig = default_rig(plant.with_values(pauses))
    return drawn(replace(rig, fixed=rig.fixed | pauses.keys()), rng)


def _run(plant: Plant, method: str, number: int) -> dict[str, dict[str, list[float | None]]]:
    made, truth = {method: _designed(plant.name, method)}, drawn_plant(plant, number)
    try:
        rows = check_followed(
            truth, made, ["ekf"], _claimed(plant), believed=plant, seed=number
        ).rows
    except ArithmeticError:
        return {}
    return {
        row.scenario: {
            name: [plain(row.figures[name]), plain(most)] for name, most in row.asked.items()
        }
        for row in rows
    }


def _claimed(plant: Plant) -> list[str]:
    """The tasks that are claimed to hold: of rig and arm what moves, not the step."""
    return [name for name in tasks_of(plant) if name != STEP]


@cache
def _designed(name: str, method: str) -> Controller:
    """The design for all draws, which is the same."""
    return design(method, PLANTS[name]()).controller


def shares(runs: Sequence[Run]) -> dict[tuple[str, str], np.ndarray]:
    """What was found over what is asked, by scenario and figure, shape (n_draws,).

    Infinite where a run was lost; a bound that nothing can hold, as of a valve that never gets
    there, is held by all that stay finite.
    """
    keys = [(s, f) for s, figures in max(runs, key=len, default={}).items() for f in figures]
    return {(s, f): np.array([_share(run, s, f) for run in runs]) for s, f in keys}


def labelled_shares(found: Runs) -> dict[str, dict[str, np.ndarray]]:
    """The same by plant, and by scenario and figure in words."""
    return {
        name: {f"{s}, {_words(f)}": values for (s, f), values in shares(runs).items()}
        for name, runs in found.items()
    }


def _share(run: Run, scenario: str, figure: str) -> float:
    if scenario not in run:
        return np.inf
    found, most = run[scenario][figure]
    if most is None:
        return 0.0
    return np.inf if found is None else found / most


def follower_claims(found: Runs) -> Iterator[Claim]:
    """Every figure on every drawn plant, and no draw lost, each with where it fails."""
    for name, runs in found.items():
        best = BENCHES[name].best
        for (scenario, figure), share in shares(runs).items():
            told = f"{100.0 * float(share.max()):.0f} % of it at most; beyond in {_beyond(share)}"
            asked = f"{_words(figure)} within {_bounds(runs, scenario, figure)}"
            claim = f"{name}, {best}, {scenario}: {asked} on every drawn plant"
            yield Claim(claim, told, bool((share <= 1.0).all()))
        lost = [f"draw {k + 1} ({_apart(name, k)})" for k, run in enumerate(runs) if not run]
        yield Claim(f"{name}, {best}: no draw is unstable", "; ".join(lost) or "none", not lost)


def _beyond(share: np.ndarray) -> str:
    places = np.flatnonzero(~(share <= 1.0))
    return f"draws {listed([str(k + 1) for k in places])}" if len(places) else "no draw"


def _bounds(runs: Sequence[Run], scenario: str, figure: str) -> str:
    """What is asked, from the least to the most of all draws."""
    asked = [run[scenario][figure][1] for run in runs if scenario in run]
    ends = [value for value in (_least(asked), _most(asked)) if value is not None]
    words = list(dict.fromkeys(shown(value, figure, 3) for value in ends))
    return " to ".join(words) or "any"


def _least(values: Sequence[float | None]) -> float | None:
    return min((v for v in values if v is not None), default=None)


def _most(values: Sequence[float | None]) -> float | None:
    return max((v for v in values if v is not None), default=None)


def _words(figure: str) -> str:
    return figure.removesuffix(f"_{suffix(figure)}").replace("_", " ")


def _apart(name: str, number: int) -> str:
    """What sets a drawn plant apart, in standard deviations, farthest first."""
    rig = default_rig(PLANTS[name]())
    return apart(rig, drawn_plant(rig.plant, number))


HEAD = ("plant", "design", "scenario", "figure", "median", "95 %", "worst", "at most", "met by")


def follower_text(found: Runs) -> str:
    """One line per plant, scenario and figure."""
    lines = [
        (name, BENCHES[name].best, *key, *_numbers(runs, *key), _met(share))
        for name, runs in found.items()
        for key, share in shares(runs).items()
    ]
    return columns(HEAD, [(n, b, s, _words(f), *rest) for n, b, s, f, *rest in lines])


def _met(share: np.ndarray) -> str:
    return f"{int((share <= 1.0).sum())} of {len(share)}"


def _numbers(runs: Sequence[Run], scenario: str, figure: str) -> tuple[str, ...]:
    rows = [run.get(scenario, {figure: (None, None)})[figure][0] for run in runs]
    values = np.array([np.inf if v is None else v for v in rows], dtype=float)
    ends = (np.median(values), np.percentile(values, 95.0, method="higher"), values.max())
    told = (shown(float(v), figure, 3) for v in ends)
    return (*told, _bounds(runs, scenario, figure))


def follower_numbers(found: Runs) -> dict[str, Any]:
    """All draws by plant, in SI."""
    return {name: {"design": BENCHES[name].best, "draws": runs} for name, runs in found.items()}

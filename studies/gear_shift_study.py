"""Study ``gear-shifts``: which design shifts the gearbox fast and softly, and on how many plants.

Designs side by side at the plant's own supply; hybrid MPC with the same numbers at 7 to 10 bar; and
hybrid MPC on plants drawn from their uncertainty: as delivered, where design and filter know
nothing of the draw; where they know its two valves alone; after commissioning, by a fit to one
recording of the drawn plant; known; and known by a search that judges fewer plans at a sample, for
a computer that has no time for all.

Source: paper 003 and its follow-up, Appl. Sci. 2020, 10(10), 3514, which ranks scheduled designs
above LQ and LQ above PD; physics.md 7, case 4.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

from controllers.design_file import design
from controllers.switched_feedback import averaged, switched_lq, switched_pd
from linearize.standard import shift_modes
from studies.checking import apart, drawn, styled_figures
from studies.commissioning import claims as claims_after
from studies.commissioning import commissioned, made_on_every_plant, reached_table
from studies.kept import Kept, Row
from studies.shift_check import (
    FEWER,
    SHIFTS,
    VALVES,
    Shift,
    ShiftCheck,
    check_shifts,
    shift_table,
    valves_off,
)
from studies.study import Claim, Extent, Outcome, Study
from studies.versions import work_folder
from studies.workers import chosen_workers
from workbench.contracts import Controller
from workbench.plant import Plant
from workbench.plants.gearbox import gearbox
from workbench.rig import default_rig

SUPPLIES_PA = (7e5, 8e5, 9e5, 10e5)
DRAWS = {Extent.QUICK: 3, Extent.FULL: 30}
FIRST_SEED = 1  # of the draws
SUPPLY = "supply.pressure_pa"
HYBRID, PD, LQ, SCHEDULED = "hybrid MPC", "PD", "LQ", "scheduled LQ"


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """All of it; draws are kept in ``folder``, and a second start goes on with the rest."""
    say("designs side by side")
    beside = check_shifts(gearbox(), designs(gearbox()), SHIFTS)
    supplies = {}
    for supply_pa in SUPPLIES_PA:
        say(f"supply of {1e-5 * supply_pa:g} bar")
        plant = gearbox().with_values({SUPPLY: supply_pa})
        supplies[supply_pa] = check_shifts(plant, {HYBRID: hybrid(plant)}, SHIFTS).rows
    found = _drawn_rows(Kept(work_folder(folder) / "rows.jsonl"), DRAWS[extent], say)
    rows, after, known, fewer = (found[key] for key in ("shifts", "after", "known", "fewer"))
    by_knowledge = {
        "as delivered": _of(rows, HYBRID),
        "valves known": found["valves"],
        "after": after,
        "known": known,
    }
    text = "\n\n".join(
        [
            shift_table(beside.rows),
            *(f"{1e-5 * p:g} bar\n{shift_table(found)}" for p, found in supplies.items()),
            f"{DRAWS[extent]} draws, missed by\n{_missed(rows)}",
            told_known(_missed_known(rows, known)),
            f"after commissioning, missed by\n{_missed(after)}",
            reached_table({**by_knowledge, f"known, {FEWER} judged": fewer}),
        ]
    )
    drawn_claims = (*_claims_of_draws(rows), *claims_after(after, _of(rows, HYBRID)))
    claims = (*_claims(beside.rows, supplies), *drawn_claims)
    numbers = {
        "beside": [vars(row) for row in beside.rows],
        "supplies": {f"{1e-5 * p:g} bar": [vars(r) for r in f] for p, f in supplies.items()},
        "draws": {name: _reached(rows, name) for name in SHIFTS},
        "valves known": {name: _reached(found["valves"], name) for name in SHIFTS},
        "after commissioning": {name: _reached(after, name) for name in SHIFTS},
        "known": {name: _reached(known, name) for name in SHIFTS},
        "known, fewer judged": {name: _reached(fewer, name) for name in SHIFTS},
        "ranking": ranking(rows),
    }
    return Outcome(text, claims, styled_figures(_shown(beside)), numbers)


def designs(plant: Plant) -> dict[str, Controller]:
    """Hybrid MPC and its rivals, the last two behind PWM."""
    plain = rivals(plant)
    pulsed = {f"{name}, PWM": averaged(plain[name]) for name in (PD, SCHEDULED)}
    return {HYBRID: hybrid(plant), **plain, **pulsed}


def rivals(plant: Plant) -> dict[str, Controller]:
    """PD, LQ and scheduled LQ, a valve energised where its share is above one half."""
    modes = shift_modes(plant)
    return {
        PD: switched_pd(modes),
        LQ: switched_lq(modes, scheduled=False),
        SCHEDULED: switched_lq(modes, scheduled=True),
    }


def hybrid(plant: Plant) -> Controller:
    """Hybrid MPC with its own numbers."""
    return design("hybrid-mpc", plant).controller


def _drawn_rows(kept: Kept, number: int, say: Callable[[str], None]) -> dict[str, list[Shift]]:
    """Shifts on so many drawn plants by what is known of them; what is kept is not run again."""
    pieces = {f"draw {k + 1}": k for k in range(number)}
    found = chosen_workers().keep(
        kept, _draw, pieces, lambda done, of: say(f"{done} of {of} drawn plants")
    )
    keys = ("shifts", "valves", "after", "known", "fewer")
    return {key: [Shift(**row) for each in found for row in each[key]] for key in keys}


def _draw(number: int) -> Row:
    """All four shifts on the plant of a draw, by what is known of it.

    Nothing, by every design; the valves, what one recording shows, and all, by hybrid MPC, and by
    one that judges fewer plans.
    """
    plant, own = gearbox(), f"{HYBRID} {number + 1}"
    truth = _truth(number)

    def known_as(believed: Plant, strength: float = 0.0) -> tuple[Shift, ...]:
        found = check_shifts(
            truth,
            {own: hybrid(believed)},
            SHIFTS,
            believed=believed,
            seed=number,
            strength=strength,
        )
        return found.rows

    made = {f"{name} {number + 1}": found for name, found in _compared().items()}
    rows = check_shifts(truth, made, SHIFTS, believed=plant, seed=number).rows
    quick = design("hybrid-mpc", truth, {"judged": FEWER}).controller
    fitted = commissioned(truth, number).rig
    groups = {
        "shifts": rows,
        "valves": known_as(valves_alone(truth)),
        "after": known_as(fitted.plant, valves_off(fitted)),
        "known": known_as(truth),
        "fewer": check_shifts(truth, {own: quick}, SHIFTS, seed=number, strength=0.0).rows,
    }
    return {key: [vars(row) for row in found] for key, found in groups.items()}


def valves_alone(truth: Plant) -> Plant:
    """The nominal gearbox with the valves of another one."""
    own = {name: value for name, value in truth.values.items() if name.startswith(VALVES)}
    return gearbox().with_values(own)


def _truth(number: int) -> Plant:
    """The plant of a draw, the same at every call."""
    return drawn(default_rig(gearbox()), np.random.default_rng(FIRST_SEED + number))


def told_known(known: Iterable[Shift]) -> str:
    """Whether it is the knowledge of the plant that a missed shift lacks, and of which plants."""
    known = list(known)
    reached = sum(row.reached for row in known)
    head = (
        f"of the {len(known)} missed, made by a design and a filter that know the plant: {reached}"
    )
    rig, numbers = default_rig(gearbox()), dict.fromkeys(_number(row) for row in known)
    lines = [f"draw {k}: {apart(rig, _truth(k - 1))}" for k in numbers]
    return "\n".join([head, *lines])


def _missed_known(rows: Iterable[Shift], known: Iterable[Shift]) -> list[Shift]:
    """Of the shifts with a known plant those that are missed without."""
    missed = {(row.design, row.scenario) for row in _of(rows, HYBRID) if not row.reached}
    return [row for row in known if (row.design, row.scenario) in missed]


def _number(row: Shift) -> int:
    """Of the draw of a row, from 1."""
    return int(row.design.rpartition(" ")[2])


@cache
def _compared() -> dict[str, Controller]:
    """Hybrid MPC and the designs that the follow-ups rank, made once for all draws."""
    return {HYBRID: hybrid(gearbox()), **rivals(gearbox())}


def _of(rows: Iterable[Shift], name: str) -> list[Shift]:
    """The shifts of one design, of all draws."""
    return [row for row in rows if row.design.rpartition(" ")[0] == name]


def _reached(rows: Iterable[Shift], scenario: str) -> float:
    """Share of the draws in which hybrid MPC makes a shift fast and soft."""
    made = [row.reached for row in _of(rows, HYBRID) if row.scenario == scenario]
    return float(np.mean(made))


def ranking(rows: Iterable[Shift]) -> dict[str, list[float]]:
    """Time of all four shifts on each drawn plant, in s, by design; infinite if one never ends."""
    rows, found = list(rows), {}
    for name in (SCHEDULED, LQ, PD):
        own = _of(rows, name)
        draws = dict.fromkeys(row.design for row in own)
        found[name] = [_settling_s(own, draw) for draw in draws]
    return found


def _settling_s(rows: Iterable[Shift], name: str) -> float:
    """Sum over the four shifts of one design."""
    return sum(row.settling_s for row in rows if row.design == name)


def _claims(rows: Iterable[Shift], supplies: Mapping[float, Iterable[Shift]]) -> Iterator[Claim]:
    missed = [
        f"{row.scenario} at {1e-5 * p:g} bar"
        for p, found in supplies.items()
        for row in found
        if not row.reached
    ]
    told = f"missed: {', '.join(missed)}" if missed else "all"
    yield Claim(f"{HYBRID}: four shifts fast and soft at 7 to 10 bar", told, not missed)
    rivals = [row for row in rows if row.design != HYBRID and row.reached]
    told = ", ".join(f"{row.design} {row.scenario}" for row in rivals) or "none"
    yield Claim("no rival makes any of the shifts fast and soft", told, not rivals)
    times = [_settling_s(rows, name) for name in (SCHEDULED, LQ, PD)]
    told = ", ".join(f"{1e3 * time:.0f} ms" for time in times)
    claim = "all four shifts take least time scheduled, more by LQ, most by PD"
    yield Claim(claim, told, times == sorted(times))


def _claims_of_draws(rows: Iterable[Shift]) -> Iterator[Claim]:
    yield from made_on_every_plant(HYBRID, _of(rows, HYBRID))
    yield from _claims_of_order(ranking(rows))


def _claims_of_order(times: Mapping[str, list[float]]) -> Iterator[Claim]:
    """What the follow-ups rank, looked for on drawn plants: each of the two neighbours."""
    scheduled, lq, pd = (np.array(found) for found in times.values())
    medians = ", ".join(f"{name} {1e3 * np.median(t):.0f} ms" for name, t in times.items())
    slowest = (pd > lq) & (pd > scheduled)
    told = f"on {int(slowest.sum())} of {len(pd)}; medians {medians}"
    yield Claim(
        "PD takes longer than LQ, scheduled or not, on every drawn plant", told, bool(slowest.all())
    )
    faster = int((scheduled < lq).sum())
    chance = binomtest(faster, len(lq), alternative="greater").pvalue
    told = f"on {faster} of {len(lq)}, which chance alone gives with {100.0 * chance:.2g} %"
    claim = "scheduled LQ takes less time than LQ on most drawn plants"
    yield Claim(claim, told, 2 * faster > len(lq))


def _missed(rows: Iterable[Shift]) -> str:
    return shift_table([row for row in _of(rows, HYBRID) if not row.reached]) or "none"


def _shown(beside: ShiftCheck) -> ShiftCheck:
    """What a figure has room for."""
    pairs = zip(beside.rows, beside.records, strict=True)
    kept = [(row, record) for row, record in pairs if row.design in (HYBRID, PD, SCHEDULED)]
    return ShiftCheck(*map(tuple, zip(*kept, strict=True)))


STUDY = Study(
    name="gear-shifts",
    question="which design shifts the gearbox fast and softly at any supply, and on drawn plants?",
    source="paper 003 and Appl. Sci. 2020, 10(10), 3514",
    run=run,
    plants=("gearbox",),
    seeds="draw k, from 0: 1 + k",
)

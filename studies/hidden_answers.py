"""How the questions of study ``hidden-effects`` are answered: each ends in one row."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from math import isnan, nan
from time import monotonic

from studies.hidden_benches import Bench, bench_of
from studies.hidden_effects import Answer, Recorded, answer
from studies.hidden_rows import Kind, Row
from studies.hidden_tasks import Task
from workbench.diagnosis.addition import Addition, accept, assembled
from workbench.diagnosis.improve import improve
from workbench.diagnosis.improvement import Improvement
from workbench.diagnosis.refit import refit, refit_shaken
from workbench.diagnosis.result import Diagnosis, Verdict
from workbench.diagnosis.rough import rough_fit
from workbench.diagnosis.scan import scan
from workbench.diagnosis.size import Size
from workbench.fitting.problem import posed
from workbench.rig import Rig

MOST_DIFFERENCES = 3
WIDER = 3.0  # 15 % where the catalogue says 5 %


def answered(task: Task, recorded: Recorded) -> Row:
    """The row of a task."""
    begun = monotonic()
    case, (train, held_out) = task.cases[0], recorded
    if task.kind is Kind.PAIR:
        row = pair_row(task, improve(bench_of(case).user_rig(*task.cases), [train], [held_out]))
    else:
        rig = bench_of(case).user_rig(case)
        rig = widened(rig, WIDER) if task.kind is Kind.WIDTH else rig
        said = answer(case, train, held_out, rig)
        if task.kind in (Kind.LAW, Kind.NOTHING):
            said = beyond_differences(said, rig, recorded)
        row = row_of(task, said)
        if task.kind is Kind.EFFECT and isnan(row.own_drop):
            row = replace(row, own_drop=own_drop(said, rig))
    return replace(row, seconds=monotonic() - begun)


def beyond_differences(said: Answer, rig: Rig, recorded: Recorded) -> Answer:
    """The answer once the small differences that really are there were named and added.

    A truth differs from the model in more than what it hides; where one of these differences leads
    and is accepted, the user adds it and asks again.
    """
    steps: list[Addition] = []
    while said.names_a_difference and len(steps) < MOST_DIFFERENCES:
        steps.append(accept(assembled(rig, steps), said.diagnosis))
        train, held_out = recorded
        said = answer(said.case, train, held_out, assembled(rig, steps))
    return said


def widened(rig: Rig, factor: float) -> Rig:
    """The rig with every standard deviation of a prior multiplied."""
    own = {name: factor * rig.standard_deviation(name) for name in rig.plant.values}
    return replace(rig, deviations={name: size for name, size in own.items() if size > 0.0})


def row_of(task: Task, said: Answer) -> Row:
    """What a diagnosis said, in plain numbers."""
    case, ranking, bench = said.case, said.diagnosis.ranking, bench_of(said.case)
    name = bench.public_name(case)
    own = next((r for r in ranking if r.candidate.name == name and r.fit is not None), None)
    weak = said.diagnosis.verdict is Verdict.RECORDING_TOO_WEAK
    balances = _balances(said.diagnosis)
    told = next(iter(ranking[0].size.values()), Size(nan, nan))
    return Row(
        kind=task.kind,
        plant=task.plant,
        hidden=task.hidden,
        seed=task.seed,
        size=case.size,
        first=said.named,
        found=told.value,
        deviation=told.deviation,
        verdict=said.diagnosis.verdict.value,
        place=said.place,
        tied=said.tied,
        right=weak if task.kind is Kind.WEAK else said.right,
        own_drop=own.drop_train if own else nan,
        balance=" and ".join(balances),
        balance_right=bool(balances) and {*balances} <= {*bench.laws.get(case.hidden or "", ())},
        crowd=len(ranking[0].crowd),
        beside=said.beside,
    )


def own_drop(said: Answer, rig: Rig) -> float:
    """Share of the misfit that the hidden effect removes, where the diagnosis did not refit it.

    What no recording shows is not refitted, but neither is what stands behind many that do the
    same: only its own refit tells whether it can be seen.
    """
    base, name = said.diagnosis.base, bench_of(said.case).public_name(said.case)
    problem = posed(rig, base, said.diagnosis.base_validation)
    candidates = [c for c in problem.whole.candidates.values() if c.name == name]
    profiles = scan(
        problem.whole, base.windows, base.unknowns, base.point, candidates, base.derivatives
    )
    found = [refit(problem, rough_fit(problem, profile)) for profile in profiles]
    return max((refit_shaken(problem, each).drop_train for each in found), default=nan)


def _balances(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Those of all terms of the law that is told, else the one where the smoother finds a lack."""
    if diagnosis.law:
        return diagnosis.law.balances
    return (diagnosis.where.balance,) if diagnosis.where else ()


def pair_row(task: Task, said: Improvement) -> Row:
    """What was added one after the other, against the two that were hidden."""
    bench = bench_of(task.cases[0])
    leaders = [each.ranking[0] for each in said.diagnoses if each.ranking]
    tied = {c.name: row.tied_with for row in leaders for c in row.candidate.singles}
    hidden = [str(bench.public_name(case)) for case in task.cases]
    accepted, wrong = counted(said.kept, tied, hidden, bench)
    return Row(
        kind=task.kind,
        plant=task.plant,
        hidden=task.hidden,
        seed=task.seed,
        size=nan,
        first=" + ".join(said.kept),
        found=nan,
        verdict=said.diagnoses[-1].verdict.value,
        place=0,
        tied=False,
        right=accepted == len(hidden) and not wrong,
        accepted=accepted,
        wrong=wrong,
    )


def counted(
    kept: Collection[str], tied: dict[str, tuple[str, ...]], hidden: Collection[str], bench: Bench
) -> tuple[int, int]:
    """How many of the hidden effects were accepted, and how many effects that are not there.

    An effect stands for the one hidden effect that it was tied with in its round, if it is no
    hidden one itself.  The small differences that every truth has are there, and what was tied
    with one of them stands for that one alike, once.
    """
    left = [name for name in hidden if name not in kept]
    stood_for = [name for name in kept if bench.always_has(name)]
    wrong = 0
    for name in (each for each in kept if each not in hidden):
        alike = tied.get(name, ())
        own = [other for other in alike if other in left]
        there = [o for o in alike if bench.always_has(o) and o not in stood_for]
        if own:
            left.remove(own[0])
        elif name in stood_for:
            continue
        elif there:
            stood_for.append(there[0])
        else:
            wrong += 1
    return len(hidden) - len(left), wrong

"""One round of diagnosis: which physical effect is missing.

Prior fit, projected profile scan over the catalogue, refits of the best few, judgement on a
held-out recording, ties, and the verdict in words.  Nothing is changed and nothing is written.

Source: diagnosis.md 1.2 to 1.9.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from workbench.diagnosis.judge import (
    CLEARLY_LESS,
    HELD_OUT_REASON,
    LEAST_TRAINING,
    SHARE_REASON,
    predicts,
    reasons_against,
    tie_group,
)
from workbench.diagnosis.law import empirical_law
from workbench.diagnosis.refit import Refit, refit, refit_shift
from workbench.diagnosis.result import DecidedBy, Diagnosis, Law, Ranked, Verdict
from workbench.diagnosis.scan import Profile, scan
from workbench.diagnosis.shifts import LEAVES_PRIOR, Shift, shifts
from workbench.diagnosis.where import locate
from workbench.effect import Kind
from workbench.fitting.errors import errors_of
from workbench.fitting.problem import Problem, improved_base, pose, split
from workbench.fitting.windows import MOST_WINDOWS
from workbench.plant import Candidate
from workbench.recording import Recording
from workbench.rig import Rig

REFITTED = 5  # candidates that are followed beyond the scan at the most
ALWAYS_REFITTED = 2
SHIFTS_REFITTED = 2  # parameters that leave their priors
WORTH_A_REFIT = 0.25  # of the best drop of the scan, for shifts of the best refit
CERTAIN_SHARE = 0.5  # an accepted candidate above it needs no comparison with an empirical law

WEAK_EVIDENCE = "no validation recording: the last third is held out, which is weak evidence"

Progress = Callable[[str], None]


def silent(message: str) -> None:
    """Progress that nobody reads."""


def diagnose(
    rig: Rig,
    train: Sequence[Recording],
    validation: Sequence[Recording] = (),
    progress: Progress = silent,
    most_windows: int = MOST_WINDOWS,
) -> Diagnosis:
    """Which effect of the catalogue is missing, judged on held-out recordings.

    Without ``validation`` the last third of each recording is held out, and the verdict is at most
    a tie, with a warning.  ``most_windows`` bounds the windows that are fitted: fewer are faster.

    Raises
    ------
    ValueError
        If the recordings are too short for a window or show no noise.
    """
    warnings: tuple[str, ...] = ()
    held_out = bool(validation)
    if not held_out:
        train, validation = split(train)
        warnings = (WEAK_EVIDENCE,)
    progress("prior fit")
    problem = pose(rig, train, validation, most_windows)
    if not problem.base.converged:
        warnings += ("the prior fit did not converge: the ranking is provisional",)
    found = _followed(problem, progress)
    better = improved_base(problem, [each.fit for each in found.refits])
    if better:
        progress("the prior fit is improved by what the refits found: once more")
        problem = better
        found = _followed(problem, progress)
    profiles, refits, moved = found.profiles, found.refits, found.moved
    ranking = _ranking(problem, profiles, refits, moved)
    progress("where it fails")
    where = locate(problem, train)
    law = _law(problem, ranking, progress)
    verdict = _verdict(ranking, law, held_out)
    best = next((r for r in refits if ranking and r.candidate == ranking[0].candidate), None)
    if best and not best.fit.converged:
        warnings += (f"the refit with {best.candidate.name} did not converge: its size may be off",)
    return Diagnosis(
        rig_name=rig.name,
        verdict=verdict,
        sentence=_sentence(verdict, ranking, law),
        ranking=ranking,
        where=where,
        before=errors_of(problem.base, problem.base_validation),
        after=errors_of(best.fit, best.validation) if best else {},
        law=law if verdict is Verdict.NOT_IN_CATALOGUE else None,
        warnings=warnings,
        base=problem.base,
        base_validation=problem.base_validation,
    )


@dataclass(frozen=True)
class _Followed:
    """Scan, refits (best first), and shifts of fitted parameters."""

    profiles: list[Profile]
    refits: list[Refit]
    moved: list[Shift]


def _followed(problem: Problem, progress: Progress) -> _Followed:
    """Scan the catalogue and refit the best few."""
    progress("scan of the catalogue")
    profiles = _scanned(problem)
    refits: list[Refit] = []
    for rank, profile in enumerate(profiles[:REFITTED]):
        accepted = any(not reasons_against(problem.base, each) for each in refits)
        promising = profile.drop > WORTH_A_REFIT * profiles[0].drop
        hopeful = not accepted and profile.drop > LEAST_TRAINING * problem.misfit
        if rank < ALWAYS_REFITTED or promising or hopeful:
            progress(f"refit with {profile.candidate.name}")
            refits.append(refit(problem, profile))
    moved = shifts(problem)
    least = WORTH_A_REFIT * max((each.drop_train for each in refits), default=0.0)
    for shift in [each for each in moved if each.leaves and each.drop > least][:SHIFTS_REFITTED]:
        progress(f"refit with {shift.name} free")
        refits.append(refit_shift(problem, shift))
    refits.sort(key=lambda each: (not predicts(each), -each.drop_train))
    return _Followed(profiles, refits, moved)


def _scanned(problem: Problem) -> list[Profile]:
    """Profiles of the causes that are not there and not shifts of fitted parameters."""
    base = problem.base
    values = base.plant.values
    known = problem.whole.parameters
    absent = [
        c
        for c in problem.whole.candidates.values()
        if c.held is None and c not in problem.added and base.windows.plant.ready_for(c)
        and (c.cause.tolerated or values.get(c.strength, known[c.strength].null)
             == known[c.strength].null)
    ]  # fmt: skip
    at = problem.linearised
    return scan(problem.whole, base.windows, base.unknowns, base.point, absent, at)


def _ranking(
    problem: Problem, profiles: list[Profile], refits: list[Refit], moved: list[Shift]
) -> tuple[Ranked, ...]:
    """All candidates, best first.

    Refits, among them shifts of parameters, come first, then the refits that the held-out
    recording refuses, then the rest by the scan.
    """
    by_name = {profile.candidate.name: profile for profile in profiles}
    group = tie_group(refits, by_name) if refits else []
    names = [each.candidate.name for each in group]
    tied = {name: tuple(n for n in names if n != name) for name in names}
    rows = {r.candidate.name: _refitted(problem, r, by_name, tied) for r in refits}
    order = [*names, *(name for name in rows if name not in names)]
    followed = [rows[name] for name in order if predicts_row(rows[name])]
    refused = [rows[name] for name in order if not predicts_row(rows[name])]
    rest = [_shifted(shift) for shift in moved if shift.candidate.name not in rows]
    rest += [_scanned_row(problem, p) for p in profiles if p.candidate.name not in rows]
    rest.sort(key=lambda row: -row.drop_train)
    asked = (*followed, *refused, *rest)
    return (*asked, *_not_asked(problem, {row.candidate.name for row in asked}))


def _not_asked(problem: Problem, asked: set[str]) -> list[Ranked]:
    """Causes of the rig's plant without a row yet: measured here, or there already.

    Where the recording measures what a cause produces, the cause has no place.
    """
    nothing = float("nan")
    return [
        Ranked(
            candidate=candidate,
            kind=candidate.cause.kind,
            size={},
            drop_train=nothing,
            drop_validation=nothing,
            tied_with=(),
            compensable=nothing,
            decided_by=DecidedBy.NOT_APPLICABLE,
            accepted=False,
            reasons=(_reason_not_asked(problem, candidate),),
        )
        for name, candidate in problem.rig.plant.candidates.items()
        if name not in asked
    ]


def _reason_not_asked(problem: Problem, candidate: Candidate) -> str:
    if candidate.name not in problem.whole.candidates:
        return "not applicable: measured"
    if not problem.rig.plant.ready_for(candidate):
        return f"nothing without {candidate.member}.{candidate.cause.needs}"
    return "there already"


def predicts_row(row: Ranked) -> bool:
    """False where the held-out recording refuses a refit."""
    return HELD_OUT_REASON not in row.reasons


def _refitted(
    problem: Problem, each: Refit, profiles: dict[str, Profile], tied: dict[str, tuple[str, ...]]
) -> Ranked:
    against = reasons_against(problem.base, each)
    profile = profiles.get(each.candidate.name)
    return Ranked(
        candidate=each.candidate,
        kind=Kind.EFFECT if profile else Kind.PARAMETER,
        size=each.size,
        drop_train=each.drop_train,
        drop_validation=each.drop_validation,
        tied_with=tied.get(each.candidate.name, ()),
        compensable=profile.compensation if profile else 1.0,
        decided_by=DecidedBy.REFIT,
        accepted=not against,
        reasons=against,
        fit=each.fit,
    )


def _shifted(shift: Shift) -> Ranked:
    """A shift that was not refitted counts by what freeing it would bring."""
    stays = (f"{shift.name} stays within {LEAVES_PRIOR:g} deviations of its prior",)
    return Ranked(
        candidate=shift.candidate,
        kind=Kind.PARAMETER,
        size={shift.name: shift.size},
        drop_train=shift.drop if shift.leaves else 0.0,
        drop_validation=float("nan"),
        tied_with=(),
        compensable=1.0,
        decided_by=DecidedBy.SCAN,
        accepted=False,
        reasons=("only a shift of a fitted parameter",) if shift.leaves else stays,
    )


def _scanned_row(problem: Problem, profile: Profile) -> Ranked:
    return Ranked(
        candidate=profile.candidate,
        kind=Kind.EFFECT,
        size={},
        drop_train=profile.drop / problem.misfit,
        drop_validation=float("nan"),
        tied_with=(),
        compensable=profile.compensation,
        decided_by=DecidedBy.SCAN,
        accepted=False,
        reasons=("not among the best of the scan",),
    )


def _law(problem: Problem, ranking: tuple[Ranked, ...], progress: Progress) -> Law | None:
    """An empirical law, unless an effect of the catalogue explains most of the misfit already.

    A parameter that leaves its prior is no such effect: it may well imitate the law.
    """
    leader = ranking[0] if ranking else None
    certain = leader and leader.accepted and leader.kind is Kind.EFFECT
    if leader and certain and leader.drop_train >= CERTAIN_SHARE:
        return None
    progress("empirical law")
    law = empirical_law(problem)
    followed = [r.drop_train for r in ranking if r.fit is not None and predicts_row(r)]
    left = 1.0 - max(followed, default=0.0)
    return law if law and 1.0 - law.drop_train < (1.0 - CLEARLY_LESS) * left else None


def _verdict(ranking: tuple[Ranked, ...], law: Law | None, held_out: bool) -> Verdict:
    """The verdict of interface.md section 4."""
    if law:
        return Verdict.NOT_IN_CATALOGUE
    leader = ranking[0] if ranking else None
    if leader and leader.accepted:
        return Verdict.TIE if leader.tied_with or not held_out else Verdict.FOUND
    if leader and leader.reasons == (SHARE_REASON,):
        return Verdict.SMALL_PROXY
    return Verdict.NOTHING_MISSING


def _sentence(verdict: Verdict, ranking: tuple[Ranked, ...], law: Law | None) -> str:
    """The verdict in words."""
    leader = ranking[0] if ranking else None
    name = leader.candidate.name if leader else ""
    share = f"{leader.drop_train:.0%}" if leader else ""
    if verdict is Verdict.FOUND:
        return f"{name} is missing: it removes {share} of the misfit beyond noise"
    if verdict is Verdict.TIE:
        if not leader or not leader.tied_with:
            return f"{name} ({share} of the misfit), on no more than one recording"
        others = ", ".join(leader.tied_with)
        return f"{name} ({share} of the misfit), not to be told here from {others}"
    if verdict is Verdict.SMALL_PROXY:
        return f"{name} explains {share} of the misfit and may stand for something else"
    if verdict is Verdict.NOT_IN_CATALOGUE and law:
        return f"nothing in the catalogue: {law.text} (empirical, not a physical effect)"
    return "nothing in the catalogue earns its place"

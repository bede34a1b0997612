"""The rows of a ranking: refits, then what the scan alone decided, then what was not asked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import nan

from workbench.candidate import Candidate
from workbench.diagnosis.judge import HELD_OUT_REASON, reasons_against
from workbench.diagnosis.power import visible_from
from workbench.diagnosis.refit import Refit
from workbench.diagnosis.result import DecidedBy, Ranked
from workbench.diagnosis.scan import Profile
from workbench.diagnosis.score import modification_index
from workbench.diagnosis.shifts import Shift, stays
from workbench.diagnosis.ties import LARGEST_TIE, imitation, tie_group
from workbench.effect import Kind
from workbench.fitting.problem import Problem
from workbench.rig_laws import is_law
from workbench.units import public_name


def ranked(
    problem: Problem,
    profiles: list[Profile],
    refits: list[Refit],
    moved: list[Shift],
    begun: Mapping[str, float],
) -> tuple[Ranked, ...]:
    """All candidates, best first.

    Refits, among them shifts of parameters, come first, then the refits that the held-out
    recording refuses, then the rest by the scan.  ``begun`` are the shares that first fits removed.
    """
    by_name = {profile.candidate.name: profile for profile in profiles}
    group = tie_group(problem, refits, by_name) if refits else []
    together = [each.candidate.name for each in group]
    rows = {
        r.candidate.name: refitted_row(problem, r, by_name.get(r.candidate.name)) for r in refits
    }
    for name in (each for each in together if each in by_name):
        alike = (n for n in together if n != name and n in by_name)
        shares = {n: imitation(by_name[name], by_name[n]) for n in alike}
        rows[name] = replace(rows[name], imitated_by=shares)
    rows |= {row.candidate.name: row for row in grouped([rows[name] for name in together])}
    order = [*together, *(name for name in rows if name not in together)]
    followed = [rows[name] for name in order if predicts_row(rows[name])]
    refused = [rows[name] for name in order if not predicts_row(rows[name])]
    rest = [_shifted(problem, shift) for shift in moved if shift.candidate.name not in rows]
    rest += [_scanned_row(problem, p, begun) for p in profiles if p.candidate.name not in rows]
    rest.sort(key=lambda row: -row.drop_train)
    asked = (*followed, *refused, *rest)
    return (*asked, *_not_asked(problem, {row.candidate.name for row in asked}))


def grouped(rows: Sequence[Ranked]) -> list[Ranked]:
    """Rows of what does the same, with the first three as the printed tie, the others the crowd."""
    names = [row.candidate.name for row in rows]
    printed, crowd = names[:LARGEST_TIE], tuple(names[LARGEST_TIE:])
    return [
        replace(
            row,
            tied_with=tuple(n for n in printed if n != name) if name in printed else (),
            crowd=crowd if name == names[0] else (),
        )
        for name, row in zip(names, rows, strict=True)
    ]


def _not_asked(problem: Problem, asked: set[str]) -> list[Ranked]:
    """Causes of the rig's plant without a row yet: measured here, fixed, or there already.

    Where the recording measures what a cause produces, the cause has no place.  Empirical terms
    that the rig has are no causes.
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
        if name not in asked and not is_law(name)
    ]


def _reason_not_asked(problem: Problem, candidate: Candidate) -> str:
    if candidate.name not in problem.whole.candidates:
        return "not applicable: measured"
    if not problem.rig.plant.ready_for(candidate):
        return f"nothing without {public_name(candidate.needed)}"
    if (candidate.held or candidate.strength) in problem.rig.fixed:
        return "not applicable: fixed by the rig"
    if candidate.held and candidate.held not in problem.base.unknowns.names:
        return f"not applicable: {public_name(candidate.held)} has no uncertainty"
    return "there already"


def predicts_row(row: Ranked) -> bool:
    """False where the held-out recording refuses a refit."""
    return HELD_OUT_REASON not in row.reasons


def refitted_row(
    problem: Problem,
    each: Refit,
    profile: Profile | None = None,
) -> Ranked:
    """The row of a refit; a single effect has the profile of its scan, a parameter has none."""
    against = reasons_against(problem.base, each)
    shift = profile is None and len(each.candidate.singles) == 1
    row = Ranked(
        candidate=each.candidate,
        kind=Kind.PARAMETER if shift else Kind.EFFECT,
        size=each.size,
        drop_train=each.drop_train,
        drop_validation=each.drop_validation,
        tied_with=(),
        compensable=profile.compensation if profile else 1.0,
        decided_by=DecidedBy.REFIT,
        accepted=not against,
        reasons=against,
        plain_validation=each.plain_validation,
        plain_chance=each.plain_chance,
        rig_value=problem.rig.plant.values[next(iter(each.size))] if shift else nan,
        fit=each.fit,
        validation=each.validation,
    )
    return _with_scan(problem, row, profile) if profile else row


def _shifted(problem: Problem, shift: Shift) -> Ranked:
    """A shift that was not refitted counts by what freeing it would bring."""
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
        reasons=("only a shift of a fitted parameter",) if shift.leaves else (stays(shift.name),),
        rig_value=problem.rig.plant.values[shift.name],
    )


def _scanned_row(problem: Problem, profile: Profile, begun: Mapping[str, float]) -> Ranked:
    name = profile.candidate.name
    reason = "not among the best of the scan"
    if name in begun:
        reason = f"left behind after a first fit, which removed {begun[name]:.0%}"
        if begun[name] < 0.0:
            reason = "left behind: no first fit with it came as low as the prior fit"
    elif profile.drop <= 0.0:
        reason = "brings nothing"
    row = Ranked(
        candidate=profile.candidate,
        kind=Kind.EFFECT,
        size={},
        drop_train=profile.drop / problem.misfit,
        drop_validation=float("nan"),
        tied_with=(),
        compensable=profile.compensation,
        decided_by=DecidedBy.SCAN,
        accepted=False,
        reasons=(reason,),
    )
    return _with_scan(problem, row, profile)


def _with_scan(problem: Problem, row: Ranked, profile: Profile) -> Ranked:
    """The row with what the scan alone tells of its candidate."""
    strength = problem.whole.parameters[profile.candidate.strength]
    return replace(
        row,
        visible_from=visible_from(problem, profile),
        drop_wide=profile.drop_wide / problem.misfit,
        modification_index=modification_index(profile, strength),
    )

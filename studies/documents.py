"""Results as plain dictionaries for JSON; the keys are a contract (interface.md section 4)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from studies.plain import plain
from studies.shift_cases import case_deviations, mean_deviations
from studies.text_of_law import law_document
from studies.text_of_next_recording import conduct_document
from workbench.diagnosis.result import told
from workbench.fitting.noise_source import NoiseSource
from workbench.units import public_name, si_unit

if TYPE_CHECKING:
    from linearize.modes import HybridModel
    from linearize.regions import Validity
    from studies.closed_loop_check import Check
    from workbench.comparison.compare import Comparison, RecordingComparison
    from workbench.diagnosis.located import Where
    from workbench.diagnosis.result import Diagnosis, NextRecording, Ranked
    from workbench.fitting.errors import SignalError
    from workbench.fitting.posterior import Moved
    from workbench.plant import Candidate

Document = dict[str, Any]


def comparison_document(found: Comparison) -> Document:
    """A comparison: errors by horizon and signal, regimes, worst windows, gear shifts.

    ``shift_cases`` holds the shifts of all recordings by case, as Table I of paper 003, and
    ``shift_cases_mean`` the mean of its cases.
    """
    cases = case_deviations([shift for each in found.recordings for shift in each.shifts])
    return {
        "schema": "workbench.comparison/1",
        "rig": found.rig_name,
        "recordings": [_compared(each) for each in found.recordings],
        "shift_cases": [
            {"case": e.case, "shifts": e.shifts, "deviation": _deviations(e.deviations)}
            for e in cases
        ],
        "shift_cases_mean": _deviations(mean_deviations(cases)),
    }


def _deviations(found: Mapping[str, float]) -> Document:
    """Deviation measure by public output name."""
    return {public_name(name): plain(share) for name, share in found.items()}


def _compared(each: RecordingComparison) -> Document:
    return {
        "recording": each.name,
        "errors": {
            horizon: {public_name(name): signal(error, name) for name, error in row.items()}
            for horizon, row in each.errors.items()
        },
        "noise": {
            public_name(name): {
                "value": None if noise.source is NoiseSource.NONE else plain(noise.value),
                "unit": si_unit(name),
                "from": noise.source.value,
            }
            for name, noise in each.noise.items()
        },
        "lags_outside_band": {
            public_name(name): plain(residual.outside) for name, residual in each.residuals.items()
        },
        "judged_on": each.judged,
        "window_s": plain(each.window_s),
        "by_regime": [
            {
                "regime": regime.name,
                "share_of_error": plain(regime.share_of_error),
                "share_of_time": plain(regime.share_of_time),
            }
            for regime in each.by_regime
        ],
        "worst": [{key: plain(value) for key, value in vars(span).items()} for span in each.worst],
        "shifts": [
            {
                "case": shift.case,
                "start_s": plain(shift.start_s),
                "end_s": plain(shift.end_s),
                "deviation": _deviations(shift.deviations),
            }
            for shift in each.shifts
        ],
        "notes": list(each.notes),
        "findings": [
            {**vars(finding), "weight": finding.weight.value} for finding in each.findings
        ],
    }


def diagnosis_document(found: Diagnosis, unit_of: Mapping[str, str]) -> Document:
    """A diagnosis, with the keys of interface.md section 4."""
    named = found.named
    return {
        "schema": "workbench.diagnosis/1",
        "rig": found.rig_name,
        "verdict": found.verdict.value,
        "effect": named.candidate.cause.name if named else None,
        "at": named.candidate.place if named else None,
        "together_with": _partner(named.candidate) if named else None,
        "sentence": found.sentence,
        "contradicted": found.contradicted,
        "too_short": found.too_short,
        "ranking": [_ranked(row) for row in found.ranking],
        "where": _where(found.where) if found.where else None,
        "law": law_document(found.law) if found.law else None,
        "strained": [moved_document(row) for row in found.strained],
        "before": errors(found.before, unit_of),
        "after": {"train": {}, "validation": {}} | errors(found.after, unit_of),
        "next_recording": _next_recording(found.next_recording),
        "warnings": list(found.warnings),
    }


def modes_document(
    rig_name: str, hybrid: HybridModel, regions: Iterable[Validity] = ()
) -> Document:
    """The modes as plain numbers, what is left out of them, and which combinations are none."""
    from linearize.listing import document

    return {
        "schema": "workbench.modes/1",
        "rig": rig_name,
        "left_out": [vars(item) for item in hybrid.model.left_out],
        "no_modes": [vars(item) for item in hybrid.no_modes],
        "jumps": [vars(jump) for jump in hybrid.jumps],
        "modes": document(hybrid, regions),
    }


def check_document(rig_name: str, found: Check) -> Document:
    """A closed-loop check: one entry per run, in SI."""
    rows = []
    for row in found.rows:
        values = {key: _plain_figure(value) for key, value in vars(row).items()}
        rows.append({**values, "reached": row.reached})
    return {"schema": "workbench.check/1", "rig": rig_name, "runs": rows}


def _plain_figure(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: plain(each) for key, each in value.items()}
    return value if isinstance(value, str) else plain(value)


def errors(
    sets: Mapping[str, Mapping[str, SignalError]], unit_of: Mapping[str, str]
) -> dict[str, dict[str, Document]]:
    """Errors by set and public output name."""
    return {
        label: {public_name(name): signal(e, unit_of.get(name, name)) for name, e in row.items()}
        for label, row in sets.items()
    }


def signal(error: SignalError, name: str) -> Document:
    """The error of one signal in SI."""
    return {
        "rmse": plain(error.rmse),
        "unit": si_unit(name),
        "fit_percent": plain(error.fit_percent),
        "noise": plain(error.noise),
        "chi2_per_sample": plain(error.chi2_per_sample),
        "left_out": error.left_out,
        "left_out_from": vars(error.left_out_from) if error.left_out_from else None,
    }


def moved_document(row: Moved) -> Document:
    """A parameter before and after a fit, in SI."""
    return {
        "name": public_name(row.name),
        "unit": si_unit(row.name),
        "before": plain(row.before),
        "before_std": plain(row.prior_deviation),
        "after": plain(row.after),
        "after_std": plain(row.deviation),
        "at_bound": row.at_bound,
        "prior_deviations_moved": plain(row.far),
    }


def _partner(candidate: Candidate) -> Document | None:
    """The second effect of a pair."""
    return next(({"effect": c.cause.name, "at": c.place} for c in candidate.singles[1:]), None)


def _ranked(row: Ranked) -> Document:
    """A row of the ranking; the sizes of a pair go by full names, two may have an ``area``."""
    pair = len(row.candidate.singles) > 1
    return {
        "effect": row.candidate.cause.name,
        "at": row.candidate.place,
        "together_with": _partner(row.candidate),
        "kind": row.kind.value,
        "size": {
            public_name(name)[0 if pair else public_name(name).rfind(".") + 1 :]: {
                "value": plain(size.value),
                "unit": si_unit(name),
                "std": plain(size.deviation),
            }
            for name, size in row.size.items()
        },
        "error_drop_train": plain(told(row.drop_train)),
        "error_drop_validation": plain(told(row.drop_validation)),
        "plain_error_validation": plain(row.plain_validation),
        "error_drop_wide_priors": plain(told(row.drop_wide)),
        "modification_index": plain(row.modification_index),
        "tied_with": list(row.tied_with),
        "imitated_by": {name: plain(share) for name, share in row.imitated_by.items()},
        "compensable": plain(row.compensable),
        "visible_from": plain(row.visible_from),
        "blind": row.blind,
        "decided_by": row.decided_by.value,
        "accepted": row.accepted,
        "reasons": list(row.reasons),
    }


def _where(where: Where) -> Document:
    walk = where.intensities
    return {
        "balance": where.balance,
        "certain": where.certain,
        "alike": list(where.alike),
        "by_balance": {name: plain(gain) for name, gain in where.by_balance.items()},
        "against": [
            {"variable": public_name(each.variable), "explains": plain(each.explains)}
            for each in where.against
        ],
        "loops": [
            {
                "variable": public_name(each.variable),
                "by": public_name(loop.by),
                "adds": plain(loop.adds),
            }
            for each in where.against
            for loop in each.loops
        ],
        "memory": where.memory is not None,
        "imitated_by_parameters": plain(where.imitated),
        "random_walk": {
            "term": public_name(where.term_name),
            "likeliest": plain(walk.likeliest),
            "neighbour": plain(walk.neighbour),
            "unit": f"{si_unit(where.term_name)}/s^0.5",
        }
        if walk
        else None,
        "by_regime": [
            {"regime": name, "share_of_error": plain(share)}
            for name, share in where.by_regime.items()
        ],
    }


def _next_recording(asked: NextRecording | None) -> Document | None:
    """What to record next; its gain is null where nothing can be played."""
    if asked is None:
        return None
    return {
        "what": asked.what,
        "separates": list(asked.separates),
        "expected_gain": plain(asked.expected_gain),
        "alike": [list(pair) for pair in asked.alike],
        "conduct": conduct_document(asked.conduct) if asked.conduct else None,
    }

"""Diagnoses, additions and fits as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite, isnan
from typing import TYPE_CHECKING

from studies.text import columns, number, percent, removed, shown, spread
from studies.text_of_law import HOW, law_text
from studies.text_of_next_recording import next_recording_text
from studies.text_of_ranking import imitated_text, ranking_text
from workbench.diagnosis.located import LEAST_GAIN
from workbench.diagnosis.where import acts_in
from workbench.fitting.posterior import FAR_MOVED
from workbench.units import public_name

if TYPE_CHECKING:
    import numpy as np

    from workbench.diagnosis.addition import Addition
    from workbench.diagnosis.located import Where
    from workbench.diagnosis.missing_term import Dependence, Loop
    from workbench.diagnosis.result import Diagnosis
    from workbench.fitting.errors import SignalError
    from workbench.fitting.fit import FitReport
    from workbench.fitting.gauss_newton import Fit
    from workbench.fitting.posterior import Moved

CORRELATED = 0.9
SHOWN_STRAINED = 4
LOST = "which leaves too few for an RMSE"
BEFORE_AFTER = ("before", "after")
ADDED, FITTED = ("without it", "with it"), ("as it came", "fitted")  # the same of a rig's steps

Errors = Mapping[str, Mapping[str, "SignalError"]]


def diagnosis_text(found: Diagnosis, unit_of: Mapping[str, str]) -> str:
    """Verdict, ranking, where it fails, and errors before and after what is named.

    Where nothing is named, the errors stand as they are.  ``unit_of`` gives the full name, with its
    unit, of each public output name; without it errors are left out.
    """
    parts = [f"verdict: {found.verdict.value}: {found.sentence}"]
    parts += [f"warning: {warning}" for warning in found.warnings]
    parts += ["", ranking_text(found), *(imitated_text(found.named) if found.named else ())]
    if found.law:
        parts += ["", law_text(found.law), HOW]
    if found.where:
        parts += ["", where_text(found)]
    parts += strained_text(found)
    if unit_of:
        told = before_after_text(found.before, found.after, unit_of)
        parts += ["", told if found.after else errors_text(found.before, unit_of)]
    if found.next_recording:
        parts += ["", next_recording_text(found.next_recording)]
    return "\n".join(parts)


def where_text(found: Diagnosis) -> str:
    """Gain by balance, the strongest drivers and the shares of the regimes."""
    where = found.where
    assert where is not None
    gains = sorted(where.by_balance.items(), key=lambda item: -item[1])
    gaining = ", ".join(f"{public_name(k)} {number(v)}" for k, v in gains if v > 0.0)
    lines = ["where: no balance gains likelihood by an unknown input"]
    if gaining:
        lines = [f"where: {gaining} (log-likelihood gained by an unknown input)"]
    follows = [f"{public_name(d.variable)} {percent(d.explains)}" for d in where.against[:3]]
    if not where.certain:
        lines.append(f"which is hardly more than chance: below {LEAST_GAIN:g} none is to be blamed")
    elif alike := where.alike:
        others = " or ".join(alike)
        lines.append(f"which of them lacks something is not told: {where.balance}, or {others}")
    if where.certain and follows:
        lines.append(f"missing term of {where.balance} follows {', '.join(follows)}")
        lines += [] if where.memory is None else [_memory_text(*where.memory)]
    if where.by_law:
        lines.append(f"the law acts in {where.balance}: refits of windows decide, not this gain")
    lines += _elsewhere(found, where)
    shares = [f"{name} {percent(share)}" for name, share in where.by_regime.items()][:4]
    left = f"error left by the prior fit (regimes overlap): {', '.join(shares)}"
    return "\n".join([*lines, *([left] if shares else [])])


def _elsewhere(found: Diagnosis, where: Where) -> list[str]:
    """What is named and does not act where an unknown input helps most; no line where it does.

    An unknown input stands in for anything sample by sample, and so shows where the outputs tell
    most of it: a leak too slow for a noisy pressure shows in the slide that it lets go.
    """
    named = found.named
    if named is None or not where.certain:
        return []
    if any(acts_in(each, balance) for each in named.candidate.singles for balance in where.marked):
        return []
    return [f"{named.candidate.name} acts elsewhere: the ranking decides, by refits of windows"]


def strained_text(found: Diagnosis) -> list[str]:
    """Parameters that the prior fit took far from what is known of them; no line without.

    What would go on is said to be held: the value is no finding of the recordings then.
    """
    farthest = sorted(found.strained, key=lambda row: -row.far)
    told = [
        f"{public_name(row.name)} {shown(row.before, row.name)} to {shown(row.after, row.name)} "
        f"({number(row.far, 2)} prior deviations{', held there' * row.at_bound})"
        for row in farthest[:SHOWN_STRAINED]
    ]
    more = [f"and {len(farthest) - len(told)} more"] if len(farthest) > len(told) else []
    line = ", ".join((*told, *more))
    return [f"suspects, which the prior fit takes far from their priors: {line}"] if line else []


def _memory_text(followed: Dependence, loop: Loop) -> str:
    """A loop in words: what it runs over, what turns it, and how wide it is."""
    return (
        f"it runs through a loop over {public_name(followed.variable)}, another "
        f"{percent(loop.adds)} by the direction of {public_name(loop.by)}: memory, such as "
        "hysteresis, lag, presliding or heat"
    )


def before_after_text(
    before: Errors,
    after: Errors,
    unit_of: Mapping[str, str],
    words: tuple[str, str] = BEFORE_AFTER,
) -> str:
    """RMSE and fit of each output before and after, on each set, and what they leave out."""
    return errors_over(dict(zip(words, (before, after), strict=True)), unit_of)


def errors_over(states: Mapping[str, Errors], unit_of: Mapping[str, str]) -> str:
    """RMSE and fit of each output in each state of a rig, by its words; and what they leave out.

    The first state has all sets and outputs.
    """
    first, *_ = states.values()
    rows = []
    for label, name in [(each, name) for each, row in first.items() for name in row]:
        errors = [each.get(label, {}).get(name) for each in states.values()]
        full = unit_of.get(name, name)
        rmse = [shown(error.rmse, full) if error else "-" for error in errors]
        fits = [number(error.fit_percent, 3) if error else "-" for error in errors]
        rows.append((label, name, *rmse, *fits))
    begun, *later = states
    head = ("set", "signal", f"RMSE {begun}", *later, f"fit % {begun}", *later)
    left_out = [line for when, each in states.items() for line in _left_out(each, f" {when}")]
    return "\n".join((columns(head, rows), *left_out))


def windows_text(fit: Fit, held_out: Fit | None) -> str:
    """What errors of a fit are over, and why a comparison of the same rig gives others."""
    windows = fit.windows
    length_s = windows.length * windows.recordings[0].sample_time_s
    counts = f"{len(windows)} in training"
    if held_out:
        counts += f", {len(held_out.windows)} held out"
    told = f"errors over windows of {length_s:.3g} s, {counts}"
    if not windows.plant.state_list:
        return told
    return (
        f"{told}, each from a start that is fitted with the weights of this fit; `compare` takes "
        "all windows and weighs by sensor noise alone, so its RMSE is another"
    )


def _left_out(sets: Errors, when: str = "") -> list[str]:
    """What the errors do not count, in words."""
    return [
        f"{label}{when}: {name} could not be simulated for {error.left_out} samples"
        f"{_since(error)}, {LOST if isnan(error.rmse) else 'which its RMSE leaves out'}"
        for label, row in sets.items()
        for name, error in row.items()
        if error.left_out
    ]


def _since(error: SignalError) -> str:
    """Where the first of the samples lies that an error leaves out, where that is known."""
    place = error.left_out_from
    return f", the first at {place.time_s:.4g} s of {place.recording}" if place else ""


def errors_text(sets: Errors, unit_of: Mapping[str, str]) -> str:
    """RMSE, fit and noise of each output as they are, on each set."""
    rows = [
        (
            label,
            name,
            shown(error.rmse, unit_of.get(name, name)),
            number(error.fit_percent, 3),
            shown(error.noise, unit_of.get(name, name), 2),
            number(error.chi2_per_sample, 3),
        )
        for label, row in sets.items()
        for name, error in row.items()
    ]
    table = columns(("set", "signal", "RMSE", "fit %", "noise", "chi2/n"), rows)
    return "\n".join((table, *_left_out(sets)))


def unit_names(outputs: tuple[str, ...]) -> dict[str, str]:
    """Full name of each output by its public name."""
    return {public_name(name): name for name in outputs} | {name: name for name in outputs}


def addition_text(found: Addition, unit_of: Mapping[str, str]) -> str:
    """Errors before and after on both sets, and the parameters that moved."""
    drops = f"weighted misfit removed: {removed(found.drop_train)} of training"
    if isfinite(found.drop_validation):
        drops += f", {removed(found.drop_validation)} of {found.evidence.value}"
    drops += "\nweighted by the noise and by what a fit without the effect cannot follow"
    parameters = moved_text(found.parameters)
    errors = before_after_text(found.before, found.after, unit_of, ADDED)
    windows = windows_text(found.fit, found.validation_fit)
    return "\n".join((errors, windows, drops, "", parameters))


def moved_text(rows: Sequence[Moved]) -> str:
    """Parameters with their standard deviations before and after, and what is odd about them."""
    told = [
        (
            public_name(row.name),
            spread(row.before, row.prior_deviation, row.name),
            spread(row.after, row.deviation, row.name),
            "; ".join(_oddities(row)),
        )
        for row in rows
    ]
    return columns(("parameter", "before", "after", ""), told)


def _oddities(row: Moved) -> list[str]:
    """Where a parameter ended at a bound or was held, or far from where it was believed to be."""
    far = f"{number(row.far, 2)} prior deviations away"
    stopped = "held by what is believed of it" if row.held else "at its bound"
    return [stopped] * row.at_bound + [far] * (row.far > FAR_MOVED)


def fit_text(found: FitReport, unit_of: Mapping[str, str]) -> str:
    """Parameters with prior and fitted values, strong correlations, and errors."""
    rows = [
        (
            public_name(row.name),
            spread(row.prior, row.prior_deviation, row.name),
            spread(row.value, row.deviation, row.name),
            ", ".join(
                word for word, holds in (("at a bound", row.at_bound), ("flat", row.flat)) if holds
            ),
        )
        for row in found.rows
    ]
    parts = [columns(("parameter", "prior", "fitted", ""), rows), ""]
    parts += correlation_lines([row.name for row in found.rows], found.correlations)
    parts += ["", before_after_text(found.before, found.after, unit_of, FITTED)]
    parts += [windows_text(found.fit, found.validation_fit)]
    return "\n".join(parts + ([] if found.converged else ["warning: the fit did not converge"]))


def correlation_lines(names: Sequence[str], matrix: np.ndarray) -> list[str]:
    """Pairs of parameters that this recording can hardly tell apart, strongest first."""
    pairs = [
        (abs(matrix[i, k]), f"{public_name(names[i])} and {public_name(names[k])}: "
         f"{matrix[i, k]:+.2f}")
        for i in range(len(names))
        for k in range(i)
        if abs(matrix[i, k]) > CORRELATED
    ]  # fmt: skip
    if not pairs:
        return [f"no correlation above {CORRELATED}"]
    return [f"correlations above {CORRELATED}:", *(text for _, text in sorted(pairs)[::-1])]

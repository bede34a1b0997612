"""What a diagnosis may say of a recording that is doubtful, or that nothing explains.

A catalogue always has a best effect, also for a recording of another plant or of noise.  So what
the best fit leaves unexplained on held-out windows has the last word: where an output is missed by
about as much as it moves, no effect was found, whatever share of the misfit one of them removes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from workbench.consistency.explained import left_unexplained
from workbench.consistency.findings import Finding, Weight
from workbench.diagnosis.result import Diagnosis, Verdict
from workbench.diagnosis.warned import Of, Warned
from workbench.effect import Kind
from workbench.units import public_name

MOST_UNEXPLAINED = 0.9  # error over motion, of every output, by the fit that a verdict rests on


def credible(found: Diagnosis, doubts: Sequence[Finding]) -> Diagnosis:
    """The same diagnosis, with the verdict that the recordings allow.

    What was fitted to too little says nothing, and no more of whether rig and recording agree.
    """
    if found.contradicted:
        return found
    missed = _missed(found)
    if missed:
        listed = ", ".join(f"{public_name(name)} {share:.2g}" for name, share in missed.items())
        warning = Warned(
            f"nothing explains the recording (error over motion: {listed}): is it of another "
            "plant, are its commands those that were played, is the rig file right, did something "
            f"else move it between runs that stand in one file?{_two_at_once(found)}",
            Of.MODEL,
        )
        sentence = "the recording and the rig contradict each other; nothing is named"
        verdict = Verdict.RECORDING_TOO_WEAK
        return replace(
            found,
            verdict=verdict,
            sentence=sentence,
            after={},
            law=None,
            warned=(*found.warned, warning),
            contradicted=True,
        )
    sure = found.verdict in (Verdict.FOUND, Verdict.NOT_IN_CATALOGUE)
    if sure and any(each.weight is Weight.DOUBT for each in doubts):
        verdict = Verdict.TIE if found.verdict is Verdict.FOUND else found.verdict
        sentence = f"{found.sentence}, if the recording can be trusted"
        return replace(found, verdict=verdict, sentence=sentence)
    return found


def _two_at_once(found: Diagnosis) -> str:
    """What else may be, where an effect passes every criterion all the same."""
    first = found.ranking[0] if found.ranking else None
    if first is None or not first.accepted or first.kind is not Kind.EFFECT:
        return ""
    name = first.candidate.name
    return f" Or are two effects missing at once? improve looks for another one beside {name}"


def _missed(found: Diagnosis) -> dict[str, float]:
    """Outputs that move and are not explained by what the verdict rests on, or by the base.

    A crowd that does the same explains what its leader does, though nobody can tell which it is.
    """
    first = found.ranking[0] if found.ranking else None
    leader = found.named or (first if first and first.accepted else None)
    fits = (
        (found.law.validation, found.law.fit) if found.law
        else (leader.validation, leader.fit) if leader
        else (found.base_validation, found.base)
    )  # fmt: skip
    fit = next((fit for fit in fits if fit is not None), None)
    shares = left_unexplained(fit) if fit else {}
    return {name: share for name, share in shares.items() if share > MOST_UNEXPLAINED}

"""The verdict of a diagnosis, and what it says in words (interface.md section 4)."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.diagnosis.judge import (
    CERTAIN_SHARE,
    LEAST_PROXY,
    SHARE_REASON,
    SIZE_REASON,
    held_out_refuses,
    leaves_clearly_less,
    share_removed,
)
from workbench.diagnosis.power import too_weak
from workbench.diagnosis.result import NAMING, Evidence, Law, Ranked, Verdict, percent_told
from workbench.diagnosis.scan import WIDER, Profile
from workbench.diagnosis.warned import Of, Warned
from workbench.effect import Kind
from workbench.fitting.errors import Errors, errors_of
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.posterior import held_back
from workbench.fitting.problem import BELIEVED
from workbench.fitting.window_length import moves
from workbench.units import public_name

FAR_ABOVE_NOISE = 3.0  # RMSE over noise that is worth a word where nothing is named
WORSE = 1.5  # RMSE of an output with what is named over that without it, and over its noise
BEYOND = f"would go further than {BELIEVED:g} deviations from what the rig believes"
FEWEST_WINDOWS = 2  # fitted, of a plant that moves: some effect makes up for any one stroke
BLIND_SHOWN = 4  # names of what a recording cannot show
HELD_SHOWN = 3  # names of what is held
OF_ALL = "of the weighted misfit"


def judged(
    ranking: tuple[Ranked, ...], law: Law | None, held_out: bool, far: Sequence[str]
) -> Verdict:
    """The verdict; ``held_out`` is False where there is no true validation recording.

    What explains next to nothing stands for nothing.  A recording that could show few effects of
    the catalogue says little by showing none, unless what hides them are errors ``far`` above the
    noise: then something is there.  It may be what removes enough of them at any size: a spool that
    sticks within a band which the commands jump over.
    """
    if law:
        return Verdict.NOT_IN_CATALOGUE
    leader = ranking[0] if ranking else None
    if leader and leader.accepted:
        if leader.crowd:
            return Verdict.RECORDING_TOO_WEAK
        return Verdict.TIE if leader.tied_with or not held_out else Verdict.FOUND
    if unsized(ranking) if far else too_weak(ranking):
        return Verdict.RECORDING_TOO_WEAK
    if leader and leader.reasons == (SHARE_REASON,) and share_removed(leader) > LEAST_PROXY:
        return Verdict.SMALL_PROXY
    return Verdict.NOTHING_MISSING


def unsized(ranking: Sequence[Ranked]) -> bool:
    """True where what leads passes but for its size, of which the recording says nothing."""
    return bool(ranking) and ranking[0].reasons == (SIZE_REASON,)


def too_short(base: Fit) -> bool:
    """Whether too little was fitted for anything to be named; a vessel's decay is one window."""
    return moves(base.windows.plant) and len(base.windows) < FEWEST_WINDOWS


def too_short_text(base: Fit) -> str:
    """The same in words."""
    windows = base.windows
    seconds = len(windows) * windows.length * windows.recordings[0].sample_time_s
    return f"{seconds:.2g} s were fitted, too little to tell what is missing"


def far_above_noise(held_out: Fit | None) -> list[str]:
    """Outputs whose held-out error without any addition is far above their noise, in words.

    What could not be simulated is far from anything.
    """
    if held_out is None:
        return []
    errors = errors_of(held_out, None)["train"].items()
    missed = [
        f"{name} {error.rmse / error.noise:.0f} times its noise"
        for name, error in errors
        if error.rmse > FAR_ABOVE_NOISE * error.noise
    ]
    lost = [f"{n} not simulated for {e.left_out} samples" for n, e in errors if e.left_out]
    return [*missed, *lost]


def unsteady(
    ranking: tuple[Ranked, ...], profiles: Sequence[Profile], verdict: Verdict
) -> tuple[Warned, ...]:
    """A warning where the width of the priors decides which effect the scan puts first.

    What the leader is tied with already is no news.  A parameter that leads would only lead more.

    Source: diagnosis.md 2 (ranking at two prior widths).
    """
    leader = ranking[0] if verdict in NAMING else None
    if leader is None or not any(p.candidate == leader.candidate for p in profiles):
        return ()
    first = max(profiles, key=lambda each: each.drop_wide).candidate
    known = (leader.candidate.name, *leader.alike)
    if first == profiles[0].candidate or first.name in known:
        return ()
    told = f"with priors {WIDER:g} times as wide {first.name} would lead the scan"
    return (Warned(told, Of.MODEL),)


def unexplained(
    far: Sequence[str], verdict: Verdict, ranking: Sequence[Ranked]
) -> tuple[Warned, ...]:
    """A warning where no more than a proxy is named and the error stays far above the noise.

    What the recording could not show is told then: it is not to be taken for absent.
    """
    if not far or verdict in (Verdict.FOUND, Verdict.TIE, Verdict.NOT_IN_CATALOGUE):
        return ()
    told = f"unexplained errors remain on held-out windows: {', '.join(far)}"
    if verdict is not Verdict.RECORDING_TOO_WEAK and any(row.blind for row in ranking):
        told = f"{told}; {_blind(ranking)}"
    return (Warned(told, Of.ERRORS_LEFT),)


def more_missing(left: Sequence[str], named: Ranked | Law | None) -> tuple[Warned, ...]:
    """A warning where what is named leaves much of the misfit, far above the noise.

    Then it is not all that is missing, and may itself stand for something else.
    """
    if named is None or not left or share_removed(named) >= CERTAIN_SHARE:
        return ()
    told = f"held-out errors are still far above their noise with it: {', '.join(left)}"
    told = f"{told}; more is missing, and it may stand for something else"
    return (Warned(told, Of.ERRORS_LEFT),)


def refused_rivals(ranking: Sequence[Ranked], named: Ranked | None) -> tuple[Warned, ...]:
    """A warning of what leaves far less in training, where the held-out recording alone refuses it.

    A few windows refuse the right one too; then what they accept instead stands for it.
    """
    rivals = [
        f"{row.candidate.name} ({percent_told(row.drop_train)})"
        for row in ranking
        if named is not None and row.fit is not None and held_out_refuses(row.reasons)
        and row.drop_train >= CERTAIN_SHARE
        and leaves_clearly_less(row.drop_train, named.drop_train)
    ]  # fmt: skip
    if not rivals:
        return ()
    said = f"far more of the training misfit goes with {', '.join(rivals)}"
    text = (
        f"{said}, refused by what is held out alone: ask another recording before either is named"
    )
    return (Warned(text, Of.MODEL),)


def worsened(before: Errors, after: Errors) -> tuple[Warned, ...]:
    """A warning where an output is clearly worse with what is named than without it.

    The misfit weighs outputs by what is left of them, so one may pay for another; held-out errors
    are judged as the mean over outputs.
    """
    told = [
        f"{name} in {where} (x {after[where][name].rmse / error.rmse:.2g})"
        for where in after
        for name, error in before.get(where, {}).items()
        if after[where][name].rmse > WORSE * max(error.rmse, error.noise)
    ]
    if not told:
        return ()
    return (Warned(f"what is named makes errors larger: {', '.join(told)}", Of.MODEL),)


def not_converged(what: str, so: str) -> Warned:
    """A warning of a fit that did not converge, with what follows from that."""
    return Warned(f"{what} did not converge: {so}", Of.MODEL)


def held(last: Fit) -> tuple[Warned, ...]:
    """A warning where the last model would go beyond what the rig believes of its parameters.

    What is named then may stand for what these are not allowed.
    """
    names = [public_name(row.name) for row in held_back(last)]
    if not names:
        return ()
    more = f" and {len(names) - HELD_SHOWN} more" if len(names) > HELD_SHOWN else ""
    told = f"{', '.join(names[:HELD_SHOWN])}{more} {BEYOND}: `workbench fit` lets them"
    return (Warned(told, Of.MODEL),)


def sentence(
    verdict: Verdict,
    ranking: tuple[Ranked, ...],
    law: Law | None,
    evidence: Evidence = Evidence.VALIDATION,
) -> str:
    """The verdict in words, with what it was judged on where that is no other recording."""
    said = _said(verdict, ranking, law)
    if evidence.strong or verdict is Verdict.RECORDING_TOO_WEAK:
        return said
    return f"{said}, judged on {evidence.value}"


def _said(verdict: Verdict, ranking: tuple[Ranked, ...], law: Law | None) -> str:
    leader = ranking[0] if ranking else None
    if verdict is Verdict.NOT_IN_CATALOGUE and law:
        return f"nothing in the catalogue: {law.text} (empirical, not a physical effect)"
    if verdict is Verdict.RECORDING_TOO_WEAK:
        return _too_weak(ranking)
    if leader is None or verdict not in NAMING:
        return "nothing in the catalogue earns its place"
    name, share = _spoken(leader), percent_told(leader.drop_train)
    if verdict is Verdict.FOUND:
        return f"{_lack(leader)} {share} {OF_ALL}"
    if verdict is Verdict.SMALL_PROXY:
        return f"{name} explains {share} of the misfit and may stand for something else"
    if not leader.tied_with:
        return f"{name} ({share} of the misfit)"
    return f"{name} ({share} of the misfit), not to be told here from {', '.join(leader.tied_with)}"


def _lack(row: Ranked) -> str:
    """What is missing, or is not as the rig says, up to the share that it removes."""
    name = _spoken(row)
    if len(row.candidate.singles) > 1:
        return f"{name} are missing: they remove"
    if row.kind is Kind.PARAMETER:
        moved = public_name(next(iter(row.size)))
        return f"{name}: {moved} is not what the rig says; another value removes"
    return f"{name} is missing: it removes"


def _spoken(row: Ranked) -> str:
    """The name of a candidate in a sentence."""
    names = " and ".join(each.name for each in row.candidate.singles)
    return f"{names} together" if len(row.candidate.singles) > 1 else names


def _too_weak(ranking: tuple[Ranked, ...]) -> str:
    leader = ranking[0]
    if leader.accepted:
        return f"{_spoken(leader)} and {', '.join(leader.alike)} do the same to this recording"
    if unsized(ranking):
        removes = f"removes {percent_told(leader.drop_train)} {OF_ALL}"
        return f"{_spoken(leader)} {removes}, in a size that this recording does not tell"
    return _blind(ranking)


def _blind(ranking: Sequence[Ranked]) -> str:
    """What the recording cannot show, in words."""
    blind = [row.candidate.name for row in ranking if row.blind]
    names = ", ".join(blind[:BLIND_SHOWN])
    more = f" and {len(blind) - BLIND_SHOWN} more" if len(blind) > BLIND_SHOWN else ""
    return f"this recording would not show {names}{more}, were they there in their typical size"

"""A design as text: the margins of each mode, and what is known beyond the modes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import degrees, isinf
from typing import TYPE_CHECKING

from studies.instability_text import UNSTABLE, unstable_text
from studies.text import columns, number

if TYPE_CHECKING:
    from controllers.certificate import Certificate
    from controllers.foresight import Delays
    from controllers.hybrid_mpc import HybridMpc
    from controllers.margins import Margins
    from studies.design_report import DesignReport

HEAD = (
    "mode",
    "gain down to",
    "gain up to",
    "phase deg",
    "delay ms",
    "distance",
    "disk x",
    "disk deg",
    "loop",
)
SCOPE = (
    "for the sampled loops without limits; while the valve is shut or brakes, nothing is claimed"
)
NO_LAWS = (
    "no margins: the law is the plant's own model, not one linear law per mode; `workbench check` "
    "says what the whole plant makes of it"
)
ALL_STATES = (
    "all states are taken as known, no estimator is in the loop: margins of full-state feedback"
)
FILTERED = (
    "the same with the steady Kalman filter of each mode in the loop, for the noise of `check`:"
)
MEASURED = (
    "the law acts on the measurement itself and foresees nothing, as under `check --estimator raw`"
)
FORESEEN = "foreseen by each mode as by the estimators of `check` (the certificate: exactly)"
DRY = "margins of linear modes say nothing of dry friction: `workbench check` is what counts"


def design_texts(found: DesignReport) -> Iterator[str]:
    """What is known of a design: margins of each mode, and what is certified across them."""
    made = found.design.controller
    if found.design.method == "hybrid-mpc":
        yield search_text(made)
    elif not found.laws:
        yield NO_LAWS
    for part in found.laws:
        clock = made.sample_time_s
        yield margins_text(part.margins, part.delays, unstable_text(part.growth), clock)
        if part.filtered:
            yield f"{FILTERED}\n{columns(HEAD, [_row(each) for each in part.filtered])}"
        yield certificate_text(part.certificate)


def margins_text(
    found: Iterable[Margins],
    delays: Delays | None = None,
    unstable: str = UNSTABLE,
    sample_time_s: float = 0.0,
) -> str:
    """One line per mode, a dash where the loop has no such margin, and what is in the loop.

    A ``sample_time_s`` of 0 is not told.  ``unstable`` says what an unstable loop does, and is told
    where there is one.
    """
    found = [*found]
    lines = [columns(HEAD, [_row(each) for each in found])]
    sampled = f"sampled every {1e3 * sample_time_s:g} ms, " if sample_time_s else ""
    lines += [] if delays is None else [sampled + _in_the_loop(delays)]
    lines += [] if delays is None or delays.foreseen else [DRY]
    lines += [] if all(each.stable for each in found) else [unstable]
    return "\n".join(lines)


def _in_the_loop(delays: Delays) -> str:
    """Which delays the margins are for, and what the law is taken to know."""
    commands = f"commands, {FORESEEN}" if delays.foreseen else "commands"
    sizes = {"sensors": delays.sensors_s, commands: delays.commands_s}
    late = [f"{1e3 * size:g} ms of the {whose}" for whose, size in sizes.items() if size]
    led = ", led by what an estimator tells of it" if delays.foreseen else ""
    for lag in delays.lags:
        late.append(f"a lag of {number(1e3 * lag.time_constant_s, 3)} ms of the {lag.name}{led}")
    knows = ALL_STATES if delays.foreseen else MEASURED
    return f"with {' and '.join(late)}; {knows}" if late else f"without delays; {knows}"


def certificate_text(found: Certificate) -> str:
    """What is certified across modes, for which, and which pairs break it."""
    modes = f"the {len(found.modes)} modes above"
    if found.unstable:
        names = ", ".join(found.unstable)
        return f"no certificate across modes: unstable by themselves are {names}"
    if found.common is not None:
        text = f"certified across {modes}: one quadratic Lyapunov function, "
        text += f"decay {number(found.decay_per_s, 3)} 1/s under any switching"
        if found.mixing:
            return f"{text} and mixing of gains; {SCOPE}"
        alone = "each mode with its own gains; for every mix of them none was found, "
        return f"{text}, {alone}{_breaking(found.breaking)}\n{SCOPE}"
    text = f"no common quadratic Lyapunov function was found for {modes}, "
    text += _breaking(found.breaking)
    if found.dwell_s is None:
        return f"{text}\nno dwell time was found either: no certificate across modes"
    dwell = f"a dwell time of {number(1e3 * found.dwell_s, 3)} ms in each mode"
    if found.any_switching:
        dwell = (
            f"any switching between the modes, from sample to sample too ({dwell} is one sample)"
        )
    return f"{text}\ncertified is {dwell}, each with its own gains, {SCOPE}"


def search_text(made: HybridMpc) -> str:
    """What a hybrid MPC searches, and where each pair of held commands leads."""
    spec, pairs = made.spec, len(made.search.plans(0).switches) ** 2
    held = number(1e3 * spec.held * spec.sample_time_s, 3)
    lines = [f"of {pairs} pairs of plans over {spec.horizon} samples, {held} ms between switches:"]
    judged = f"{spec.judged} of the best and of those near the last plan"
    lines.append(f"ranked on affine modes; {judged} are judged as they are at a sample that ranks;")
    lines.append("on the way to Neutral every second one judges some from all over instead")
    for place_m, commands in made.drives.items():
        sent = ", ".join(f"{c:g}" for c in commands)
        lines.append(f"commands {sent} lead to {number(1e3 * place_m, 3)} mm")
    return "\n".join(lines)


def _breaking(pairs: tuple[tuple[str, str], ...]) -> str:
    """For which pairs none was found, a line for each first of them."""
    if not pairs:
        return "though for each pair of them"
    others: dict[str, list[str]] = {}
    for one, other in pairs:
        others.setdefault(one, []).append(other)
    lines = (f"  {one} with {'; '.join(several)}" for one, several in others.items())
    return "\n".join(["not even for these pairs:", *lines])


def _row(each: Margins) -> tuple[str, ...]:
    if not each.stable:
        return (each.mode, *["-"] * (len(HEAD) - 2), "unstable")
    low, high = each.gain
    ends = (number(low, 3), _end(high))
    numbers = (degrees(each.phase_rad), 1e3 * each.delay_s, each.distance)
    disk = (_end(each.disk_gain), number(degrees(each.disk_phase_rad), 3))
    return (each.mode, *ends, *(number(value, 3) for value in numbers), *disk, "stable")


def _end(factor: float) -> str:
    return "any" if isinf(factor) else number(factor, 3)

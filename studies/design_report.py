"""What is known of a design without running it: margins by mode, and a certificate across modes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from studies.instability_text import Growth, growth_of

if TYPE_CHECKING:
    from controllers.certificate import Certificate
    from controllers.design_file import Design
    from controllers.foresight import Delays
    from controllers.margins import Law, Margins
    from controllers.scheduled import Schedule
    from linearize.modes import Mode


@dataclass(frozen=True)
class LawReport:
    """Of the laws of one axis.

    body         the body that they move
    delays       what is late in the loop that the margins are for
    growth       by unstable mode, what its loop does
    certificate  across the modes; it takes what is foreseen as foreseen exactly
    filtered     margins with the steady Kalman filter of each mode, where that is known
    """

    body: str
    delays: Delays
    margins: tuple[Margins, ...]
    growth: dict[str, Growth]
    certificate: Certificate
    filtered: tuple[Margins, ...] = ()


@dataclass(frozen=True)
class DesignReport:
    """Of a design; without laws where its method has no linear law for each mode."""

    design: Design
    laws: tuple[LawReport, ...]


def design_report(found: Design, say: Callable[[str], None]) -> DesignReport:
    """Margins and certificates of all axes of a design; ``say`` is told what is looked for."""
    from controllers.nonlinear_mpc import NonlinearMpc

    made = found.controller
    parts = getattr(made, "regulators", (made,) if hasattr(made, "laws") else ())
    if isinstance(made, NonlinearMpc):  # the laws that it inherits are those of linear MPC
        parts = ()
    return DesignReport(found, tuple(_of_parts(found, parts, say)))


def _of_parts(
    found: Design, parts: tuple[Any, ...], say: Callable[[str], None]
) -> Iterator[LawReport]:
    from controllers.certificate import certificate
    from controllers.foresight import delays_of, foreseeing
    from controllers.margins import loops, margins

    hybrid, sample_time_s = found.hybrid, found.controller.sample_time_s
    for part in parts:
        axis, delays, laws = getattr(part, "axis", None), delays_of(found.plant, part), part.laws
        ahead = foreseeing(hybrid, laws, sample_time_s, axis) if delays.foreseen else laws
        whole = (hybrid, ahead, sample_time_s, delays.both_s, axis)
        by_mode = tuple(margins(*whole))
        unsettled = [each.mode for each in by_mode if not each.stable]
        closed = loops(*whole) if unsettled else {}
        growing = {name: growth_of(closed[name][0], sample_time_s) for name in unsettled}
        say("looking for a certificate across modes")
        exact = loops(hybrid, laws, sample_time_s, delays.left_s, axis)
        yield LawReport(
            body=(axis.position if axis else found.plant.measured[0]).rpartition(".")[0],
            delays=delays,
            margins=by_mode,
            growth={name: growth for name, growth in growing.items() if growth},
            certificate=certificate(exact, sample_time_s),
            filtered=_filtered(found, laws) if delays.foreseen and not delays.both_s else (),
        )


def _filtered(found: Design, laws: Schedule[Law]) -> tuple[Margins, ...]:
    """Margins on a slide whose estimator has the usual noise; it does not foresee a delay."""
    from controllers.margins import margins
    from controllers.output_feedback import lqg_law
    from controllers.scheduled import with_modes
    from linearize.standard import SLIDE_MODES
    from studies.closed_loop_check import PROCESS_NOISE, noise_of

    if found.plant.name not in SLIDE_MODES:
        return ()
    noise, sample_time_s = noise_of(found.plant), found.controller.sample_time_s

    def behind_filter(mode: Mode, law: Law) -> Law:
        return lqg_law(mode, law, PROCESS_NOISE, noise, sample_time_s)

    filtered = with_modes(found.hybrid, laws, behind_filter)
    return tuple(margins(found.hybrid, filtered, sample_time_s))

"""What is known of a design without running it: margins by mode, and a certificate across modes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from studies.instability_text import Growth, growth_of

if TYPE_CHECKING:
    from controllers.axis import Axis
    from controllers.certificate import Certificate
    from controllers.design_file import Design
    from controllers.foresight import Delays
    from controllers.margins import Law, Margins
    from controllers.scheduled import Schedule
    from linearize.modes import HybridModel, Mode
    from workbench.plant import Plant


@dataclass(frozen=True)
class LawReport:
    """Of the laws of one axis.

    body         the body that they move
    delays       what is late in the loop that the margins are for
    growth       by unstable mode, what its loop does
    certificate  across the modes; it takes what is foreseen as foreseen exactly
    filtered     margins with the steady Kalman filter of each mode in the loop, delays included;
                 none of a law that has no filter before it
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
    from controllers.lags import behind_lags, not_reading
    from controllers.margins import loops, margins

    sample_time_s = found.controller.sample_time_s
    for part in parts:
        axis, delays = getattr(part, "axis", None), delays_of(found.plant, part)
        hybrid = behind_lags(found.hybrid, delays.lags)
        laws = not_reading(part.laws, delays.lags)
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
            filtered=_filtered(hybrid, ahead, sample_time_s, delays, axis),
        )


def _filtered(
    hybrid: HybridModel,
    laws: Schedule[Law],
    sample_time_s: float,
    delays: Delays,
    axis: Axis | None,
) -> tuple[Margins, ...]:
    """Margins behind filters for the noise of `check`, which know what commands have arrived."""
    if not delays.foreseen:
        return ()
    from controllers.margins import margins
    from controllers.output_feedback import lqg_law
    from controllers.scheduled import with_modes

    noises = _noises(hybrid.plant)

    def behind_filter(mode: Mode, law: Law) -> Law:
        return lqg_law(mode, law, *noises, sample_time_s, delays.commands_s)

    filtered = with_modes(hybrid, laws, behind_filter, axis)
    return tuple(margins(hybrid, filtered, sample_time_s, delays.both_s, axis))


def _noises(plant: Plant) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """Of the process and the sensors in `check`, by state and by output."""
    from studies.closed_loop_check import PROCESS_NOISE, noise_of
    from studies.following import BENCHES

    if plant.name in BENCHES:
        bench = BENCHES[plant.name]
        return bench.process(plant), bench.noise(plant)
    return PROCESS_NOISE, noise_of(plant)

"""What of a design is told as a warning: loops that are unstable, or bear hardly anything.

And a setpoint weight whose rest comes in slowly: the axis stands still far from its target.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees, radians
from typing import TYPE_CHECKING

from controllers.two_degree_pid import PidGains, TwoDegreePid
from studies.text import number

if TYPE_CHECKING:
    from controllers.scheduled import Schedule
    from studies.design_report import DesignReport, LawReport

LEAST_PHASE_RAD = radians(30.0)  # of the textbooks' 30 to 60 deg
LONGEST_S = 1.0  # in which a step's rest may come in: those of `check` are watched for 1.2 s


def design_doubts(found: DesignReport) -> Iterator[str]:
    """One sentence for each; the tables of the design have all modes."""
    made = found.design.controller
    for part in found.laws:
        yield from _doubts(part, made.sample_time_s)
    if isinstance(made, TwoDegreePid):
        yield from _withheld(made.gains)


def _withheld(gains: Schedule[PidGains]) -> Iterator[str]:
    """What a setpoint weight takes from a step, where the integral is slow to give it back."""
    for slow in (*gains.forward, *gains.backward):
        within_s = slow.proportional / slow.integral if slow.integral else 0.0
        if slow.setpoint != 1.0 and within_s > LONGEST_S:
            share = f"{number(100.0 * abs(1.0 - slow.setpoint), 3)} % of every step"
            what = f"a setpoint weight of {slow.setpoint:g} leaves {share} to the integral"
            time = f"whose time is {number(within_s, 3)} s"
            yield f"{what}, {time}: ask for fewer integral_periods"
            return


def _doubts(part: LawReport, sample_time_s: float) -> Iterator[str]:
    if unstable := [each.mode for each in part.margins if not each.stable]:
        yield f"unstable loops, of {len(unstable)} of {len(part.margins)} modes: {_named(unstable)}"
    stable = [each for each in part.margins if each.stable]
    if not stable:
        return
    phase = min(stable, key=lambda each: each.phase_rad)
    late = min(stable, key=lambda each: each.delay_s)
    if phase.phase_rad < LEAST_PHASE_RAD:
        has = f"{number(degrees(phase.phase_rad), 3)} deg in mode '{phase.mode}'"
        yield f"the smallest phase margin is {has}, below {degrees(LEAST_PHASE_RAD):.0f}"
    if late.delay_s < sample_time_s:
        has = f"{number(1e3 * late.delay_s, 3)} ms in mode '{late.mode}'"
        yield f"the smallest delay margin is {has}, below one sample of {1e3 * sample_time_s:g} ms"


def _named(modes: list[str]) -> str:
    return ", ".join(f"'{mode}'" for mode in modes[:2]) + (", ..." if len(modes) > 2 else "")

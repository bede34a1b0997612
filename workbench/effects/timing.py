"""What happens to signals on their way between plant and computer: delay, pause, clock drift.

These act on sampled sequences, never on the equations of the plant.  Each says one thing only: when
what arrives now was sent.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.effect import Balance, Cause, Effect, Expression, form, strength

SLACK = 1e-6  # of a sample: times are multiples of it up to rounding


@dataclass(frozen=True, kw_only=True)
class Timing(Effect):
    """Signals, commands or outputs, that arrive later than they are sent.

    Between samples a signal is interpolated linearly; what was sent before the first sample is the
    first sample.

    Source: architecture.md section 4 (causes in time).
    """

    def acts_on(self, channel: str) -> bool:
        """True for the signals that it delays."""
        return channel in self.signals

    def sent_at_s(self, time_s: np.ndarray) -> np.ndarray:
        """When what arrives at these times was sent; never later than that."""
        return time_s

    def resample(self, channel: str, values: np.ndarray, sample_time_s: float) -> np.ndarray:
        if not self.acts_on(channel) or self.absent:
            return values
        samples = np.arange(len(values), dtype=float)
        return np.interp(self.sent_at_s(samples * sample_time_s) / sample_time_s, samples, values)


@dataclass(frozen=True, kw_only=True)
class SensorDelay(Timing):
    """A pure delay of outputs on their way to the computer, y(t - T).

    No cause of its own: on a recording it is the same as a delayed command.

    Source: paper 000 (1 ms each way); physics.md 2.1 and section 6 (comm_delay).
    """

    signals: tuple[str, ...]
    delay_s: Expression = strength(typical=1e-3, upper=0.2)

    def sent_at_s(self, time_s: np.ndarray) -> np.ndarray:
        return time_s - float(self.delay_s)


@dataclass(frozen=True, kw_only=True)
class PacketPause(Timing):
    """A screen that is redrawn stops all packets for a while (E-PAUSE).

    At t = n / f, n = 1, 2, ..., nothing arrives for ``pause_s``: the last value holds.  Then the
    backlog comes at once, and for ``resynchronisation_s`` every other packet is missing.

    Source: paper 001 Figs. 12 to 14 (20 ms, then almost 10 ms; redraw at 1 Hz and 10 Hz); which
    packets are missing is chosen.
    """

    causes = (
        Cause(
            name="packet_pause",
            strength="redraw_hz",
            forms=("pause_s",),
            balance=Balance.TIMING,
            drivers=("time since the redraw",),
            kinked=True,
            sizes=(0.1, 0.5, 1.0),
            shown_by="any closed loop: kicks that repeat with the redraw",
            source="paper 001 Figs. 12 to 14; physics.md section 6 (packet_pause)",
        ),
    )

    signals: tuple[str, ...]
    redraw_hz: Expression = strength(typical=10.0, upper=30.0)
    pause_s: Expression = form(20e-3, lower=0.0, upper=0.1, relative_deviation=0.2)
    resynchronisation_s: Expression = form(10e-3, lower=0.0, upper=0.1)
    packet_s: float = 1e-3

    def sent_at_s(self, time_s: np.ndarray) -> np.ndarray:
        slack_s = SLACK * self.packet_s
        redraw = np.floor((time_s + slack_s) * float(self.redraw_hz))
        begun_s = redraw / float(self.redraw_hz)
        since_s = np.where(redraw > 0, time_s - begun_s, np.inf)
        late_s = since_s - float(self.pause_s)
        odd = np.floor(late_s.clip(max=1e6) / self.packet_s + SLACK) % 2 == 1
        missing = (late_s > -slack_s) & (late_s < self.resynchronisation_s - slack_s) & odd
        held = np.where(late_s < -slack_s, begun_s - self.packet_s, time_s)
        return np.where(missing, time_s - self.packet_s, held)


@dataclass(frozen=True, kw_only=True)
class ClockDrift(Timing):
    """Two clocks that run apart: the delay grows by a share of the time passed, r t.

    No cause of its own (interface.md section 6).

    Source: observed in paper 001 (growing lag); physics.md section 6 (clock_drift).
    """

    signals: tuple[str, ...]
    drift_share: Expression = strength(typical=1e-3, upper=1e-2)

    def sent_at_s(self, time_s: np.ndarray) -> np.ndarray:
        return (1.0 - float(self.drift_share)) * time_s


def sent_at_s(members: Sequence[Effect], channel: str, time_s: np.ndarray) -> np.ndarray:
    """When what arrives at these times on a channel was sent, by all causes in time together."""
    for member in reversed(members):
        if isinstance(member, Timing) and member.acts_on(channel) and not member.absent:
            time_s = member.sent_at_s(time_s)
    return time_s


def delay_s(members: Sequence[Effect], channels: Iterable[str]) -> float:
    """How late what arrives first on these channels was sent, the longest of them.

    That is the constant part of all causes in time: a pause comes later, and a drift grows from
    nothing.
    """
    begin_s = np.zeros(1)
    delays = (float((begin_s - sent_at_s(members, c, begin_s))[0]) for c in channels)
    return max(delays, default=0.0)

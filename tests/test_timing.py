"""When what arrives was sent: delays, clocks that drift, redraws that pause everything."""

import numpy as np
import pytest
from test_effects import strengths

from workbench.effects import ClockDrift, CommandDelay, PacketPause, SensorDelay
from workbench.effects.timing import Timing, sent_at_s


@pytest.mark.parametrize("kind", [CommandDelay, SensorDelay])
def test_a_delayed_signal_is_the_signal_of_that_long_ago(kind):
    ramp = np.arange(100.0)
    place = {"signal": "a.b_v"} if kind is CommandDelay else {"signals": ("a.b_v",)}
    late = kind(name="late", delay_s=2.5e-3, **place).resample("a.b_v", ramp, 1e-3)

    assert late[3:] == pytest.approx(ramp[:-3] + 0.5)
    assert (late[:3] == 0.0).all()


def test_a_clock_that_drifts_falls_behind_more_and_more():
    ramp = np.arange(1001.0)
    drift = ClockDrift(name="drift", signals=("a.b_v",), drift_share=1e-3)

    assert ramp - drift.resample("a.b_v", ramp, 1e-3) == pytest.approx(1e-3 * ramp)


def test_a_redraw_holds_everything_for_20_ms_and_then_loses_every_other_packet():
    """E-PAUSE: at 0.1 s nothing arrives for 20 ms, then for 10 ms every other packet is missing."""
    ramp = np.arange(200.0)
    pause = PacketPause(name="pause", signals=("a.b_v",), redraw_hz=10.0)
    seen = pause.resample("a.b_v", ramp, 1e-3)

    assert seen[:100] == pytest.approx(ramp[:100])
    assert seen[100:120] == pytest.approx(99.0)
    assert seen[120:130] == pytest.approx([120, 120, 122, 122, 124, 124, 126, 126, 128, 128])
    assert seen[130:] == pytest.approx(ramp[130:])


def test_causes_in_time_change_nothing_at_their_null_nor_on_other_signals(plant):
    ramp = np.arange(100.0)
    for effect in (e for e in plant.effects if isinstance(e, Timing)):
        null = {f"{effect.name}.{key}": value for key, value in strengths(effect).items()}
        silent = next(e for e in plant.with_values(null).effects if e.name == effect.name)
        for signal in (*plant.model.commands, *plant.measured):
            assert silent.resample(signal, ramp, 1e-3) is ramp
        assert effect.resample("another.signal_v", ramp, 1e-3) is ramp


def test_what_arrives_through_several_causes_was_sent_before_all_of_them():
    """In a sequence and for a single time alike, in the plant's order."""
    delay = SensorDelay(name="delay", signals=("a.b_v",), delay_s=2e-3)
    pause = PacketPause(name="pause", signals=("a.b_v",), redraw_hz=10.0)
    time_s = 1e-3 * np.arange(500)
    for members in ((delay, pause), (pause, delay)):
        seen = time_s
        for member in members:
            seen = member.resample("a.b_v", seen, 1e-3)

        assert seen == pytest.approx(sent_at_s(members, "a.b_v", time_s).clip(min=0.0))

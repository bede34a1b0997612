"""Commands written in the dialect of a rig read back as its files are read."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.comparison.run import read_inputs
from workbench.reading.command_writer import write_commands
from workbench.recording import Recording
from workbench.recording_format import ChannelFormat, RecordingFormat, TimeFormat
from workbench.rig import default_rig

PLACE, COMMAND = "slide.position_m", "valve.command_v"


@pytest.mark.parametrize(
    "dialect",
    [
        dict(decimal=",", separator=";"),
        dict(separator="\t", skip=2),
        dict(header=False, time=TimeFormat(None, "s", 1e-3)),
        dict(time=TimeFormat("t", "ms")),
    ],
    ids=["decimal comma", "two rows to skip", "numbers for names", "milliseconds"],
)
def test_commands_read_back_in_every_dialect(tmp_path, dialect):
    rig = default_rig("servo_drive")
    column = 3 if dialect.get("header") is False else "spool (V)"
    channels = {**rig.reader.channels, COMMAND: ChannelFormat(column, "mV")}
    rig = replace(rig, reader=RecordingFormat(channels=channels, **dialect))
    played = Recording("played", 1e-3, {COMMAND: np.linspace(4.0, 6.0, 200)})
    reference = {PLACE: np.linspace(0.1, 0.2, 200)}

    write_commands(rig, played, tmp_path / "next.csv", reference)

    back = read_inputs(rig, tmp_path / "next.csv")
    np.testing.assert_allclose(back[COMMAND], played[COMMAND], rtol=1e-9)
    assert back.sample_time_s == pytest.approx(1e-3)


def test_a_file_whose_rows_tell_no_time_is_written_at_the_rate_of_its_rows(tmp_path):
    """Recorded every millisecond and resampled to 2.5: what is to last 0.5 s must not take 0.2."""
    rig = default_rig("servo_drive")
    reader = replace(rig.reader, time=TimeFormat(None, "s", 1e-3), resample_s=2.5e-3)
    rig = replace(rig, reader=reader)
    played = Recording("played", 2.5e-3, {COMMAND: np.linspace(4.0, 6.0, 201)})

    write_commands(rig, played, tmp_path / "next.csv", {})

    back = read_inputs(rig, tmp_path / "next.csv")
    assert back.time_s[-1] == pytest.approx(0.5)
    np.testing.assert_allclose(back[COMMAND], played[COMMAND], atol=0.01)
    rows = np.loadtxt(tmp_path / "next.csv", skiprows=1)
    assert rows[:6] == pytest.approx(played[COMMAND][[0, 0, 0, 1, 1, 2]])

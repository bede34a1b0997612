"""Short recordings of a servo drive as files, good and spoiled, for the tests of reading."""

import numpy as np
import pytest

from workbench.errors import InputError
from workbench.reading import read_recording
from workbench.recording import Recording
from workbench.rig import load_rig

RIG = """plant = "servo_drive"
[recording]
time = { column = "time_s", unit = "s" }
[recording.channels]
"valve.command" = { column = "command_V", unit = "V" }
"chamber_a.pressure" = { column = "pressure_a_bar", unit = "bar", noise = "400 Pa" }
"slide.position" = { column = "position_mm", unit = "mm" }
"""
NAMES = ["time_s", "command_V", "pressure_a_bar", "position_mm"]
FULL = ["valve.command_v", "chamber_a.pressure_pa", "slide.position_m"]
FACTORS = [1.0, 1e5, 1e-3]
N = 400


def table(n: int = N) -> np.ndarray:
    """Time, command, pressure and position of a short run, shape (n, 4), seeded."""
    rng = np.random.default_rng(7)
    t = 1e-3 * np.arange(n)
    columns = (t, 5 + np.sin(9 * t), 5 + np.cos(9 * t), 140 + 90 * np.sin(5 * t))
    return np.column_stack(columns) + [0, 0, 1e-3, 1e-2] * rng.standard_normal((n, 4))


def text(rows: np.ndarray, separator: str = ",", head: str | None = None) -> str:
    lines = [separator.join(f"{x:.9g}" for x in row) for row in rows]
    return "\n".join([separator.join(NAMES) if head is None else head, *lines]) + "\n"


def read(folder, content: str | bytes, section: str = "", rig: str = RIG) -> Recording:
    path = folder / "run.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_recording(load_rig(rig.replace("[recording]\n", f"[recording]\n{section}\n")), path)


def refused(folder, content: str, section: str = "", rig: str = RIG) -> str:
    with pytest.raises(InputError) as error:
        read(folder, content, section, rig)
    return str(error.value)

"""Ten minutes at 1 kHz take less than 1 GB, and runs of a check leave nothing behind.

Measured in processes of their own.
"""

import subprocess
import sys

import pytest
from child_process import imports_alike

MOST_MIB = 1e9 / 2**20
COMMANDS = {
    "servo_drive": "{'valve.command_v': 4.95 + 0.8 * wave}",
    "gearbox": "{'valve_1.command': 1.0 * (wave > 0.5), 'valve_2.command': 1.0 * (wave < -0.5)}",
}
CODE = """
import numpy as np
from peak_memory import peak_mib
from workbench.plants import PLANTS
from workbench.recording import Recording
from workbench.simulation import simulate

wave = np.sin(np.pi * 1e-3 * np.arange(600_001))
plant = PLANTS["{plant}"]()
found = simulate(plant, Recording("ten minutes", 1e-3, {commands}))
print(peak_mib(), np.ptp(found["{moves}"]))
"""


def run(*arguments):
    return subprocess.run(
        [sys.executable, *arguments],
        capture_output=True,
        text=True,
        check=False,
        env=imports_alike(),
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plant", "moves"),
    [("servo_drive", "slide.position_m"), ("gearbox", "main_piston.position_m")],
)
def test_ten_minutes_fit_into_a_gigabyte(plant, moves):
    code = CODE.format(plant=plant, commands=COMMANDS[plant], moves=moves)
    done = run("-c", code)

    assert done.returncode == 0, done.stderr
    mib, travel_m = map(float, done.stdout.split())
    assert travel_m > 0.01
    assert mib < MOST_MIB
    print(f"\n{plant}: {mib:.0f} MiB")


RUNS = """
import sys
from pathlib import Path
from peak_memory import peak_mib
from studies.many_runs import Setup, rows_of
from studies.workers import Workers
from workbench.rig import default_rig

path = Path(sys.argv[1])
setup = Setup(default_rig("servo_drive"), path, path.read_text(), ("ekf",), ("step",))
for runs in (10, 110):
    rows = rows_of(setup, runs, Workers(1))
    print(len(rows), peak_mib())
"""
MOST_MORE_MIB = 10.0  # for 100 runs more; the records of one run alone take 1


@pytest.mark.slow
def test_memory_does_not_grow_with_the_runs_of_a_check(lq):
    done = run("-c", RUNS, str(lq))

    assert done.returncode == 0, done.stderr
    few, many = (map(float, line.split()) for line in done.stdout.splitlines())
    (n, before), (m, after) = few, many
    assert (n, m) == (10, 110)
    assert after - before < MOST_MORE_MIB
    print(f"\n{before:.0f} MiB after {n:.0f} runs, {after:.0f} after {m:.0f} more")

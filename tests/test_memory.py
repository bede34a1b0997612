"""Ten minutes at 1 kHz take less than 1 GB, and runs of a check leave nothing behind.

Measured in processes of their own.
"""

import subprocess
import sys

import pytest

MOST_KIB = 1_000_000_000 // 1024
COMMANDS = {
    "servo_drive": "{'valve.command_v': 4.95 + 0.8 * wave}",
    "gearbox": "{'valve_1.command': 1.0 * (wave > 0.5), 'valve_2.command': 1.0 * (wave < -0.5)}",
}
CODE = """
import resource
import numpy as np
from workbench.plants import PLANTS
from workbench.recording import Recording
from workbench.simulation import simulate

wave = np.sin(np.pi * 1e-3 * np.arange(600_001))
plant = PLANTS["{plant}"]()
found = simulate(plant, Recording("ten minutes", 1e-3, {commands}))
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, np.ptp(found["{moves}"]))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plant", "moves"),
    [("servo_drive", "slide.position_m"), ("gearbox", "main_piston.position_m")],
)
def test_ten_minutes_fit_into_a_gigabyte(plant, moves):
    code = CODE.format(plant=plant, commands=COMMANDS[plant], moves=moves)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stderr
    kib, travel_m = done.stdout.split()
    assert float(travel_m) > 0.01
    assert int(kib) < MOST_KIB
    print(f"\n{plant}: {int(kib) / 1024:.0f} MiB")


RUNS = """
import resource, sys
from pathlib import Path
from studies.many_runs import Setup, rows_of
from studies.workers import Workers
from workbench.rig import default_rig

path = Path(sys.argv[1])
setup = Setup(default_rig("servo_drive"), path, path.read_text(), ("ekf",), ("step",))
for runs in (10, 110):
    rows = rows_of(setup, runs, Workers(1))
    print(len(rows), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""
MOST_MORE_KIB = 10_000  # for 100 runs more; the records of one run alone take 1,000


@pytest.mark.slow
def test_memory_does_not_grow_with_the_runs_of_a_check(lq):
    command = [sys.executable, "-c", RUNS, str(lq)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stderr
    few, many = (map(int, line.split()) for line in done.stdout.splitlines())
    (n, before), (m, after) = few, many
    assert (n, m) == (10, 110)
    assert after - before < MOST_MORE_KIB
    print(f"\n{before / 1024:.0f} MiB after {n} runs, {after / 1024:.0f} after {m} more")

"""The memory of a child is its own."""

import subprocess
import sys

import numpy as np
from child_process import imports_alike
from peak_memory import peak_mib

CODE = "import peak_memory; print(peak_memory.peak_mib())"
TAKES = "import numpy, peak_memory; numpy.ones(25 * 2**20); print(peak_memory.peak_mib())"


def told(code):
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env=imports_alike(),
    )
    return float(done.stdout)


def test_a_child_tells_what_it_took_itself():
    held = np.ones(25 * 2**20)  # 200 MiB here

    assert peak_mib() > 200.0 and held[0] == 1.0
    assert told(CODE) < 100.0
    assert told(TAKES) > 200.0

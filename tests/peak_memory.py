"""Most memory that a process held, told by itself."""

import resource
from pathlib import Path

STATUS = Path("/proc/self/status")


def peak_mib() -> float:
    """Most memory that this process held since its program began, MiB.

    On Linux ``getrusage`` also counts what its parent held when it began: a hundred tests later
    every child would tell of the same gigabyte.
    """
    if not STATUS.exists():
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20  # macOS: bytes
    lines = STATUS.read_text().splitlines()
    (line,) = (line for line in lines if line.startswith("VmHWM:"))
    return int(line.split()[1]) / 1024

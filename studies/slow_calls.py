"""Controllers that a machine does not compute within their sample.

A check closes the loop as if no time passed between a measurement and its command.  Where the calls
take longer than a sample, on this machine that loop cannot be run at all.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from studies.text import number

if TYPE_CHECKING:
    from studies.checking import Checked, Loops


def slow_calls(loops: Loops, found: Checked) -> str:
    """A sentence where the usual call of the only controller takes longer than its sample.

    The median over all loops, since what else the machine does makes single ones slow.
    """
    (controller,) = loops.controllers.values()
    sample_s = controller.sample_time_s
    usual_s = float(np.median([row.solve_median_s for row in found.rows])) if found.rows else 0.0
    if usual_s <= sample_s:
        return ""
    takes, has = (f"{number(1e3 * each, 2)} ms" for each in (usual_s, sample_s))
    return f"a call of the controller takes {takes} here, longer than its sample of {has}"

"""Paper 003's linear model as it is printed: a counter-example, for comparison only.

Eqs. 24 and 26 to 28 print a13, a22, a23 and a24 with the signs of a chamber 2 that grows with x,
and Eq. 16 takes the derivatives at zero flow.  At 1 bar in chamber 1 and 9 bar in chamber 2 an
eigenvalue is then +62.7 1/s, where the corrected matrix has a spring of 143 rad/s.

Source: errata E003-2, E003-3 and E003-4 of physics.md section 3.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linearize.modes import Mode
from linearize.reduction import DesignModel

PRINTED_MINUS = ((0, 2), (1, 1), (1, 2), (1, 3))


def as_printed(model: DesignModel, mode: Mode) -> Mode:
    """The mode with A at zero flow and the printed signs; point, B and drift stay."""
    A = model.jacobians(mode.state, np.zeros(len(mode.command)))[0].full()
    for entry in PRINTED_MINUS:
        A[entry] *= -1.0
    return replace(mode, A=A)

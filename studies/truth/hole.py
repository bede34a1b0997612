"""Gas through a hole of the truth: the nozzle function as a table, for any gas constant.

Source: physics.md 1.1 (nozzle form, straight above a ratio of 0.999; direction by the pressures).
"""

import numpy as np

from studies.truth.drive import GAS_CONSTANT_J_KG_K as TABLE_J_KG_K
from studies.truth.restriction import CELLS, nozzle

_EDGES = nozzle(np.linspace(0.0, 1.0, CELLS + 1))
_SLOPE = np.append(np.diff(_EDGES), _EDGES[-1] - _EDGES[-2]) * CELLS
_INTERCEPT = _EDGES - _SLOPE * np.linspace(0.0, 1.0, CELLS + 1)


def scale(gas_constant_j_kg_k: float) -> float:
    """What `stream` is to be multiplied by for a gas of this constant: Psi goes with 1/sqrt(R)."""
    return float(np.sqrt(TABLE_J_KG_K / gas_constant_j_kg_k))


def stream(above_pa, above_k, below_pa, below_k) -> tuple[np.ndarray, np.ndarray]:
    """Mass flow per effective area from above to below, and the temperature it brings.

    All arrays of one shape; the flow counts for a gas constant of 288 J/(kg K), see `scale`.
    """
    difference = above_pa - below_pa
    upstream = np.maximum(above_pa, below_pa)
    ratio = np.minimum(above_pa, below_pa) / upstream
    cell = (ratio * CELLS).astype(np.intp)
    psi = _INTERCEPT[cell] + _SLOPE[cell] * ratio
    brought_k = np.where(difference >= 0.0, above_k, below_k)
    return np.copysign(psi * upstream / np.sqrt(brought_k), difference), brought_k

"""Flow of the `crr_rig`'s valve and leaks: nozzle function, input pressure, area of the hole.

    mdot = A Psi(p_down / p_up) p_up / sqrt(T_up)
    P_in = P_E + s (P_S - P_E),   s = 1/2 + 1/2 tanh(pi du / w)
    A_eq = c_d A_seg(h),          h = c_1 |du| + c_2, at most 2 R_o

Source: physics.md 1.1 (nozzle form) and 2.1 (paper 000 eqs. 9 and 10); dead zone by 2.4.
"""

import numpy as np

from studies.truth import crr_rig as c
from studies.truth import restriction
from studies.truth.restriction import CELLS

# The tables there are for R = 288; Psi goes with 1/sqrt(R).
_SCALE = np.sqrt(restriction.GAS_CONSTANT_J_KG_K / c.GAS_CONSTANT_J_KG_K)
_CURVE = _SCALE * restriction.nozzle(np.linspace(0.0, 1.0, CELLS + 1))
_SLOPE = np.append(np.diff(_CURVE), 0.0)


def nozzle(ratio: np.ndarray) -> np.ndarray:
    """Psi of the ideal nozzle, from a table over ratios within [0, 1]."""
    place = ratio * CELLS
    cell = place.astype(np.intp)
    return _CURVE[cell] + _SLOPE[cell] * (place - cell)


def segment_m2(height_m: np.ndarray) -> np.ndarray:
    """Area of the hole's segment up to a height within [0, 2 R_o]."""
    r = c.HOLE_RADIUS_M
    return r**2 * np.arccos((r - height_m) / r) - (r - height_m) * np.sqrt(
        np.maximum(2 * r * height_m - height_m**2, 0.0)
    )


def opening_v(rig: c.CrrRig, spool_v: np.ndarray) -> np.ndarray:
    """Du at the cap side: the spool past its centre, rescaled outside the dead zone.

    Full command stays full opening for every width of the zone.
    """
    past, half = spool_v - rig.centre_v, rig.dead_zone_half_width_v
    upper, lower = c.COMMAND_RANGE_V - rig.centre_v, rig.centre_v
    above = np.maximum(past - half, 0.0) * upper / (upper - half)
    return above + np.minimum(past + half, 0.0) * lower / (lower - half)


def openings(rig: c.CrrRig, spool_v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Supply's share of the input pressure and area of the hole at the cap and the rod side.

    From spool volts of shape (substeps, n) to two arrays of shape (substeps, 2, n).
    """
    cap_v = opening_v(rig, spool_v)
    du = np.stack([cap_v, -cap_v], axis=1)
    share = 0.5 + 0.5 * np.tanh(np.pi * du / rig.underlap_v)
    full_m = 2 * c.HOLE_RADIUS_M
    height = rig.clearance_m + (full_m - rig.clearance_m) * np.abs(du) / c.SPAN_V
    height = full_m * np.minimum(height / full_m, 1.0) ** rig.hole_exponent
    charging = c.CHARGING * (1 + rig.discharge_asymmetry)
    discharging = c.DISCHARGING * (1 - rig.discharge_asymmetry)
    coefficient = rig.flow_area * np.where(du >= 0, charging, discharging)
    return share, coefficient * segment_m2(height)

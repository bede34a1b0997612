"""Laws of the true servo drive that no catalogue has: what each adds to a balance.

    quadratic_drag    F   = -c |v| v                     momentum; a plate in the air, a dashpot
    sagging_cable     F   = F_c ((y - L/2) / (L/2))^2    momentum; a cable that pulls at both ends
    sticky_spot       F   = -c v exp(-s^2)               momentum; old grease at one place
    magnetic_catch    F   = -F_m s exp((1 - s^2) / 2)    momentum; pulls to one place, F_m at most
    sliding_leak      A   = a |v|                        mass a; a seal that leaks while it slides
    purge_flow        dm  = w dt                         mass b; air from a flow controller

with s = (y - y_s) / w_s, the stroke L, the leak to ambient, and the purge as warm as the supply.
"""

import numpy as np

from studies.truth.drive import STROKE_M


def force_n(drive, position_m: np.ndarray) -> np.ndarray:
    """What depends on the place alone, in the direction of y."""
    from_middle = 2 * position_m / STROKE_M - 1
    s = (position_m - drive.spot_m) / drive.spot_width_m
    cable = drive.sagging_cable_n * from_middle**2
    return cable - drive.catch_n * s * np.exp((1 - s**2) / 2)


def drag_n_s_m(drive, position_m: np.ndarray, speed_m_s: np.ndarray) -> np.ndarray:
    """Force against the movement over its speed."""
    s = (position_m - drive.spot_m) / drive.spot_width_m
    return drive.quadratic_drag_n_s2_m2 * speed_m_s + drive.spot_drag_n_s_m * np.exp(-(s**2))

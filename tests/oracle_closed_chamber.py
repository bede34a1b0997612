"""The closed chamber once more, flat, to be read next to physics.md 1.1, 1.2 and 2.7.

x = [p, m, E] with E = C_w (T_w - T_amb).
"""

import numpy as np

K, R = 1.4, 287.0
P_ATM, T_ATM = 1.013e5, 293.15
V, SURFACE, P_0, T_0 = 1e-4, 1.3e-2, 5.65e5, 293.15
CRITICAL = (2 / (K + 1)) ** (K / (K - 1))


def psi(r):
    """Nozzle flow function; a straight line above 0.999."""
    if r <= CRITICAL:
        return np.sqrt(K / R * (2 / (K + 1)) ** ((K + 1) / (K - 1)))
    if r > 0.999:
        return psi(0.999) * (1 - r) / (1 - 0.999)
    return np.sqrt(2 * K / (R * (K - 1))) * r ** (1 / K) * np.sqrt(1 - r ** ((K - 1) / K))


def rates(x, area, coefficient, per_heat_capacity, wall_time):
    p, m, stored = x
    temperature = p * V / (m * R)
    if p >= P_ATM:
        leak, carried = area * p / np.sqrt(temperature) * psi(P_ATM / p), temperature
    else:
        leak, carried = -area * P_ATM / np.sqrt(T_ATM) * psi(p / P_ATM), T_ATM
    wall = T_ATM + per_heat_capacity * stored
    heat = coefficient * SURFACE * np.sqrt(p * temperature / (P_0 * T_0)) * (wall - temperature)
    p_dot = (-K * R * carried * leak + (K - 1) * heat) / V
    return np.array([p_dot, -leak, -heat - stored / wall_time])

"""The reservoir of paper 002 once more, flat: physics.md 2.4, with the drive oracle's own valve.

x = [p, m, E], E the heat stored in the wall.
"""

import numpy as np
from oracle_servo_drive import EXHAUST, P_ATM, P_S, SUPPLY, T_ATM, T_S, K, R, openings, stream

V, SURFACE, LAMBDA_0, P_0, T_0 = 0.344e-3, 3.419e-2, 17.275, 5.65e5, 293.15


def rates(x, u, per_heat_capacity=0.0, wall_time=100.0):
    p, m, stored = x
    temperature = p * V / (m * R)
    to_tank, from_tank = openings(u)
    m_in, t_in = stream(P_S, T_S, p, temperature, SUPPLY[0] * to_tank, SUPPLY[1])
    m_out, t_out = stream(p, temperature, P_ATM, T_ATM, EXHAUST[0] * from_tank, EXHAUST[1])
    wall = T_S + per_heat_capacity * stored
    heat = LAMBDA_0 * np.sqrt(p * temperature / (P_0 * T_0)) * SURFACE * (wall - temperature)
    p_dot = (K * R * (m_in * t_in - m_out * t_out) + (K - 1) * heat) / V
    return np.array([p_dot, m_in - m_out, -heat - stored / wall_time])

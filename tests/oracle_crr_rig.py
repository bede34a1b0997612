"""The rig of papers 000 and 001 once more, flat, to be read next to physics.md 1 and 2.1.

The only place where its physics is written twice.  Plain numpy, one state at a time; nothing of
the workbench is used.  x = [y, v, P_c, m_c, P_r, m_r].
"""

import numpy as np

K, R = 1.4, 287.0
P_S, P_E, T_S = 6.5e5, 1.013e5, 293.15
A_C, A_ROD = np.pi / 4 * 26.99e-3**2, np.pi / 4 * 7.94e-3**2
A_R = A_C - A_ROD
STROKE, V_C0, V_R0, MASS = 0.1524, 6e-6, 6e-6, 1.0
U_OFF, W = 5.25, 0.75
R_O, C2, SPAN = 1e-3, 1e-4, 4.75
C1 = (2 * R_O - C2) / SPAN
CHARGING, DISCHARGING = 0.62, 0.55
F_S, F_C, EXPONENT, K_TANH, V_S, C_V = 20.0, 13.3, 5, 1580.0, 2.54e-3, 87.56
STOP, STOP_DAMPING = 2e6, 2e3
C_SUB = np.sqrt(2 * K / (R * (K - 1)))
C_CHK = np.sqrt(K / R * (2 / (K + 1)) ** ((K + 1) / (K - 1)))


def psi(r):
    if r <= (2 / (K + 1)) ** (K / (K - 1)):
        return C_CHK
    if r > 0.999:
        return psi(0.999) * (1 - r) / 0.001
    return C_SUB * r ** (1 / K) * np.sqrt(1 - r ** ((K - 1) / K))


def segment(h):
    return R_O**2 * np.arccos((R_O - h) / R_O) - (R_O - h) * np.sqrt(2 * R_O * h - h**2)


def a_eq(du):
    h = min(C1 * abs(du) + C2, 2 * R_O)
    return (CHARGING if du >= 0 else DISCHARGING) * segment(h)


def p_in(du):
    return (P_S + P_E) / 2 + (P_S - P_E) / 2 * np.tanh(np.pi * du / W)


def friction(v):
    return (F_C + (F_S - F_C) * np.exp(-((abs(v) / V_S) ** EXPONENT))) * np.tanh(
        K_TANH * v
    ) + C_V * v


def flow(du, p, t):
    """Mass flow into a chamber and the temperature of the gas that flows."""
    p_node = p_in(du)
    if p_node >= p:
        return a_eq(du) * psi(p / p_node) * p_node / np.sqrt(T_S), T_S
    return -a_eq(du) * psi(p_node / p) * p / np.sqrt(t), t


def chamber(du, p, m, volume, volume_dot):
    """Rates of pressure and mass."""
    m_dot, t_source = flow(du, p, p * volume / (m * R))
    return K * (R * t_source * m_dot - p * volume_dot) / volume, m_dot


def volumes(y, stroke=STROKE):
    return V_C0 + A_C * y, V_R0 + A_R * (stroke - y)


def cylinder(y, v, p_c, m_c, p_r, m_r, u, stroke=STROKE):
    """Force on the rod without stops, and the rates of both chambers."""
    v_c, v_r = volumes(y, stroke)
    force = p_c * A_C - p_r * A_R - P_E * A_ROD - friction(v)
    cap = chamber(u - U_OFF, p_c, m_c, v_c, A_C * v)
    rod_side = chamber(U_OFF - u, p_r, m_r, v_r, -A_R * v)
    return force, (*cap, *rod_side)


def stop(y, v, low, high):
    if y < low:
        return max(0.0, STOP * (low - y) - STOP_DAMPING * v)
    return -max(0.0, STOP * (y - high) + STOP_DAMPING * v) if y > high else 0.0


def rates(x, u):
    y, v, *gas = x
    force, gas_rates = cylinder(y, v, *gas, u)
    return np.array([v, (force + stop(y, v, 0.0, STROKE)) / MASS, *gas_rates])

"""The servo drive of paper 002 once more, flat, to be read next to physics.md 1 and 2.4.

The only place where its physics is written twice.  Plain numpy, one state at a time; nothing of
the workbench is used.  x = [y, v, P_a, m_a, P_b, m_b, z].
"""

import numpy as np

K, R = 1.4, 288.0
P_S, T_S, P_ATM, T_ATM = 7e5, 293.15, 1e5, 293.15
S_P, L_P, D_P, M_P = 4.9087e-4, 0.290, np.sqrt(4 * 4.9087e-4 / np.pi), 2.22
V_AD, V_BD = 3.105e-5, 5.525e-5
C_D, A_MAX, CENTRE, HALF_WIDTH, LEAK = 0.5513, 2.8274e-5, 4.95, 0.42, 8e-8
SUPPLY, EXHAUST = (0.80, 0.35), (0.65, 0.30)  # share of the full area, critical ratio b
CRACKING, INDEX = 0.995, 0.52
LAMBDA_0, P_0, T_0 = 22.563, 5.65e5, 293.15
SIGMA_0, SIGMA_1 = 1.12e6, 50.0
STOP, STOP_DAMPING = 2e6, 2e3
CHOKED = np.sqrt(K / R * (2 / (K + 1)) ** ((K + 1) / (K - 1)))


def nozzle(r):
    laminar = 0.999
    at = np.sqrt(2 * K / (R * (K - 1))) / CHOKED
    if r <= (2 / (K + 1)) ** (K / (K - 1)):
        return 1.0
    if r > laminar:
        return nozzle(laminar) * (1 - r) / (1 - laminar)
    return at * r ** (1 / K) * np.sqrt(1 - r ** ((K - 1) / K))


def iso(r, b):
    regular = min(0.999 * CRACKING, CRACKING - 1e-4)
    if r >= regular:
        return max(iso(regular - 1e-15, b) * (CRACKING - r) / (CRACKING - regular), 0.0)
    return (1 - ((max(r, b) - b) / (CRACKING - b)) ** 2) ** INDEX


def stream(p_from, t_from, p_to, t_to, area, b):
    """Mass flow and its temperature through a path with the closed-centre leak beside it."""
    if p_from < p_to:
        flow, temperature = stream(p_to, t_to, p_from, t_from, area, b)
        return -flow, temperature
    r = p_to / p_from
    flow = CHOKED * p_from / np.sqrt(t_from) * (C_D * area * iso(r, b) + LEAK * nozzle(r))
    return flow, t_from


def openings(u):
    """Areas without their share: supply to a (and b to exhaust), supply to b (and a to exhaust)."""
    above = max(u - CENTRE - HALF_WIDTH, 0.0) / (10.0 - CENTRE - HALF_WIDTH)
    below = max(CENTRE - HALF_WIDTH - u, 0.0) / (CENTRE - HALF_WIDTH)
    return [A_MAX * (1 - (1 - s) ** 1.6) for s in (above, below)]


def friction(v, z):
    """Force and bristle rate of the elasto-plastic law; magnitudes by direction (E002-6)."""
    static, coulomb, viscous = (50.97, 28.35, 46.01) if v >= 0 else (46.15, 26.22, 42.18)
    z_max = (coulomb + (static - coulomb) * np.exp(-((v / 0.024) ** 2))) / SIGMA_0
    z_ba = 0.9 * z_max
    if v * z <= 0 or abs(z) <= z_ba:
        alpha = 0.0
    elif abs(z) >= z_max:
        alpha = 1.0
    else:
        alpha = 0.5 * np.sin(np.pi * (abs(z) - (z_max + z_ba) / 2) / (z_max - z_ba)) + 0.5
    z_dot = v - alpha * abs(v) * z / z_max
    return SIGMA_0 * z + SIGMA_1 * z_dot + viscous * v, z_dot


def chamber(p, m, volume, volume_dot, length, charging, exhausting):
    temperature = p * volume / (m * R)
    m_in, t_in = stream(P_S, T_S, p, temperature, SUPPLY[0] * charging, SUPPLY[1])
    m_out, t_out = stream(p, temperature, P_ATM, T_ATM, EXHAUST[0] * exhausting, EXHAUST[1])
    surface = 2 * S_P + np.pi * D_P * max(length, 0.0)
    heat = LAMBDA_0 * np.sqrt(p * temperature / (P_0 * T_0)) * surface * (T_S - temperature)
    carried = m_in * t_in - m_out * t_out
    p_dot = (K * R * carried - K * p * volume_dot + (K - 1) * heat) / volume
    return p_dot, m_in - m_out


def rates(x, u):
    y, v, p_a, m_a, p_b, m_b, z = x
    to_a, to_b = openings(u)
    p_a_dot, m_a_dot = chamber(p_a, m_a, V_AD + S_P * y, S_P * v, y, to_a, to_b)
    p_b_dot, m_b_dot = chamber(p_b, m_b, V_BD + S_P * (L_P - y), -S_P * v, L_P - y, to_b, to_a)
    dry, z_dot = friction(v, z)
    low = max(0.0, -STOP * y - STOP_DAMPING * v) if y < 0 else 0.0
    high = max(0.0, STOP * (y - L_P) + STOP_DAMPING * v) if y > L_P else 0.0
    force = S_P * (p_a - p_b) - dry + low - high
    return np.array([v, force / M_P, p_a_dot, m_a_dot, p_b_dot, m_b_dot, z_dot])

"""The gearbox actuator of paper 003 once more, flat, to be read next to physics.md 1 and 2.5.

Plain numpy, one state at a time; nothing of the workbench is used.
x = [p1, p2, pc, m1, m2, mc, x, v, x_F, v_F, theta, omega, i, x_v, v_v, i, x_v, v_v] (valve 1, 2).
"""

import numpy as np

K, R = 1.4, 287.0
P_SUP, P_AMB, T_SUP, T_AMB = 9.0e5, 1.013e5, 293.15, 293.15
D1, DS, D2, S = 50e-3, 30e-3, 65e-3, 12e-3
A1, A2, A_F = np.pi / 4 * D1**2, np.pi / 4 * DS**2, np.pi / 4 * (D2**2 - DS**2)
A_C = A1 - A2
V10, V20, VC0, A_PORT = 15e-6, 40e-6, 30e-6, 12e-6
M_M, M_F, J_SF, R_C, R_LD, R_DE = 1.0, 0.35, 1.5e-3, 50e-3, 60e-3, 50e-3
F_MU_M, F_MU_F, F_MU_MF, D_M, D_F, F = 45.0, 30.0, 10.0, 60.0, 40.0, 2000.0
S_C, D_C, S_CF, D_CF = 2e7, 4e3, 5e6, 1.5e3
F_DE, T_MAX, K_HT = 300.0, 0.6, 40.0
U, U_Z, R_COIL, N, A_P, R_M0, G_RES = 24.0, 45.0, 30.0, 1100.0, 1e-4, 2e6, 0.2e-3
X_MAX, M_V, K_S, F_0, D_V, STOP, STOP_DAMPING = 1.9e-3, 5e-3, 700.0, 2.0, 1.0, 2e5, 8.0
D_IN, D_EX, C_D = 3.2e-3, 4.0e-3, 0.72
MU_0 = 4e-7 * np.pi
LETTING_GO = 0.01  # A: below it the clamp's voltage falls in a straight line (ours)


def nozzle(r):
    """Psi(r) with the linear zone above 0.999."""
    if r <= (2 / (K + 1)) ** (K / (K - 1)):
        return np.sqrt(K / R * (2 / (K + 1)) ** ((K + 1) / (K - 1)))
    if r > 0.999:
        return nozzle(0.999) * (1 - r) / (1 - 0.999)
    return np.sqrt(2 * K / (R * (K - 1))) * r ** (1 / K) * np.sqrt(1 - r ** ((K - 1) / K))


def stream(area, p_a, t_a, p_b, t_b):
    """Mass flow from a to b, and the enthalpy flow over c_p that goes with it."""
    if p_a >= p_b:
        flow = area * p_a / np.sqrt(t_a) * nozzle(p_b / p_a)
        return flow, flow * t_a
    flow, carried = stream(area, p_b, t_b, p_a, t_a)
    return -flow, -carried


def push(depth, rate, stiffness, damping):
    """Contact that never pulls (E003-6)."""
    return max(0.0, stiffness * depth + damping * rate) if depth > 0 else 0.0


def stops(x, v, low, high):
    return push(low - x, -v, S_C, D_C) - push(x - high, v, S_C, D_C)


def valve(i, x, v, c):
    """Rates of current and armature, and the two effective areas."""
    lift = min(max(x, 0.0), X_MAX)
    reluctance = R_M0 + (G_RES + X_MAX - lift) / (MU_0 * A_P)
    inductance = N**2 / reluctance
    slope = N**2 / (reluctance**2 * MU_0 * A_P)
    voltage = U if c == 1 else -U_Z * min(max(i / LETTING_GO, -1.0), 1.0)
    lifting = v if 0.0 <= x <= X_MAX else 0.0  # the clipped position stands still in the stops
    i_dot = (voltage - R_COIL * i - i * slope * lifting) / inductance
    walls = push(-x, -v, STOP, STOP_DAMPING) - push(x - X_MAX, v, STOP, STOP_DAMPING)
    force = 0.5 * i**2 * slope - F_0 - K_S * x - D_V * v + walls
    inlet = C_D * min(np.pi * D_IN * lift, np.pi * D_IN**2 / 4)
    exhaust = C_D * min(np.pi * D_EX * (X_MAX - lift), np.pi * D_EX**2 / 4)
    return [i_dot, v, force / M_V], inlet, exhaust


def gas(p, m, volume, volume_dot, wall_area, inlet, exhaust):
    """Rates of pressure and mass; the heat enters with kappa - 1 (E003-1)."""
    temperature = p * volume / (m * R)
    m_in, h_in = stream(inlet, P_SUP, T_SUP, p, temperature)
    m_out, h_out = stream(exhaust, p, temperature, P_AMB, T_AMB)
    heat = -K_HT * wall_area * (temperature - T_AMB)
    p_dot = (K * R * (h_in - h_out) - K * p * volume_dot + (K - 1) * heat) / volume
    return p_dot, m_in - m_out


def volumes(x, x_f):
    v1 = V10 + A1 * (x + S)
    v2 = V20 + A2 * (S - x) + A_F * (S - x_f)
    return v1, v2, VC0 + A_F * x_f - A_C * x


def rates(state, c1, c2, f_ld=0.0):
    p1, p2, pc, m1, m2, mc, x, v, x_f, v_f, theta, omega = state[:12]
    valve_1, in_1, ex_1 = valve(*state[12:15], c1)
    valve_2, in_2, ex_2 = valve(*state[15:18], c2)
    v1, v2, vc = volumes(x, x_f)
    wall_1 = 2 * A1 + 4 * A1 / D1 * (x + S)
    p1_dot, m1_dot = gas(p1, m1, v1, A1 * v, wall_1, in_1, ex_1)
    p2_dot, m2_dot = gas(p2, m2, v2, -A2 * v - A_F * v_f, 2 * A_F, in_2, ex_2)
    pc_dot, mc_dot = gas(pc, mc, vc, A_F * v_f - A_C * v, 2 * A_F, 0.0, A_PORT)
    f_cp = push(x - x_f, v - v_f, S_C, D_C)
    f_mf = F_MU_MF * np.tanh(F * (v - v_f) / 2)
    f_m, f_f = F_MU_M * np.tanh(F * v / 2) + D_M * v, F_MU_F * np.tanh(F * v_f / 2) + D_F * v_f
    f_c = S_CF * (x - R_C * theta) + D_CF * (v - R_C * omega)
    main = p1 * A1 - p2 * A2 - pc * A_C - f_cp - f_m - f_mf + stops(x, v, -S, S) - f_c
    floating = (pc - p2) * A_F + f_cp - f_f + f_mf + stops(x_f, v_f, 0.0, S)
    tan_alpha = T_MAX * np.sin(2 * np.pi * R_C * theta / S)
    torque = f_c * R_C - f_ld * R_LD - tan_alpha * F_DE * R_DE
    moving = [v, main / M_M, v_f, floating / M_F, omega, torque / J_SF]
    return np.array([p1_dot, p2_dot, pc_dot, m1_dot, m2_dot, mc_dot, *moving, *valve_1, *valve_2])

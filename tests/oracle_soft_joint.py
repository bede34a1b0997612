"""The bellows of paper 004 once more, flat, to be read next to physics.md 1.1 and 2.6.

Plain numpy, one state; nothing of the workbench is used.  The flow function is the paper's own,
z of p_u/p_d with its alpha, beta and theta, and the molar mass where Eq. 1 lacks it (E004-1).
"""

import numpy as np

K, R, M, Z, T, C = 1.4, 8.31, 0.029, 0.99, 293.15, 0.72
A_MAX, V, P_SRC, P_ATM = 25e-6, 0.5e-3, 5.5e5, 1.013e5
C_F, C_V, EPS = 0.52, 0.48, 0.01
ALPHA = C * np.sqrt(2 * M / (Z * R * T) * K / (K - 1))
BETA = C * np.sqrt(K * M / (Z * R * T) * (2 / (K + 1)) ** ((K + 1) / (K - 1)))
THETA = ((K + 1) / 2) ** (K / (K - 1))
LAMINAR = 0.999


def z(p_u, p_d):
    """Flow per area, upstream above downstream; a straight line above 0.999 (E004-2)."""
    if p_u / p_d > THETA:
        return BETA * p_u
    rho = p_d / p_u
    if rho > LAMINAR * (1 + 1e-12):
        return z(p_u, LAMINAR * p_u) * (1 - rho) / (1 - LAMINAR)
    return ALPHA * p_u * np.sqrt(rho ** (2 / K) - rho ** ((K + 1) / K))


def phi(p_u, p_d):
    return z(p_u, p_d) if p_u >= p_d else -z(p_d, p_u)


def smax(x):
    return (np.sqrt(x**2 + 1) + x) / 2


def areas(c):
    fill = A_MAX * min(1, EPS / (1 - C_F) * smax((c - C_F) / EPS))
    vent = A_MAX * min(1, EPS / C_V * smax((C_V - c) / EPS))
    return fill, vent


def rate(p, pwm):
    current = 2 * (pwm - 0.5)
    fill, vent = areas((current + 1) / 2)
    mdot = fill * phi(P_SRC, p) - vent * phi(p, P_ATM)
    return K * Z * R * T / M / V * mdot

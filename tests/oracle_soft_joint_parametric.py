"""The one-time-constant model of paper 004 once more, flat: physics.md 2.6, tau dp/dt = a f."""

import numpy as np

P_SRC, P_ATM = 5.5e5, 1.013e5
C_F, C_V, EPS = 0.52, 0.48, 0.01
TAU_AREA, TAU_LINEAR = 0.05, 0.075


def smax(x):
    return (np.sqrt(x**2 + 1) + x) / 2


def area_map(c):
    fill = min(1, EPS / (1 - C_F) * smax((c - C_F) / EPS))
    vent = min(1, EPS / C_V * smax((C_V - c) / EPS))
    return fill - vent


def linear_map(c):
    return 2 * c - 1


def rate(p, a, tau):
    f = P_SRC - p if a >= 0 else p - P_ATM
    return a * f / tau

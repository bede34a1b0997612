"""The arm of papers 000 and 001, flat, to be read next to physics.md 2.2.

The cylinder is the rig's (oracle_crr_rig).  x = [theta, omega, P_c, m_c, P_r, m_r].
"""

import numpy as np
import oracle_crr_rig as rig

A, B, PHI_0 = 0.170, 0.045, np.radians(30.0)
L_MIN, STROKE = 0.1395, 0.0635
M_L, LENGTH, L_C, G, B_J = 0.5, 0.3048, 0.1524, 9.81, 0.02
J = M_L * LENGTH**2 / 3 + 0.003
RANGE = np.radians([17.0, 95.0])


def geometry(theta, a=A, b=B, phi_0=PHI_0):
    """Length of the cylinder and lever."""
    length = np.sqrt(a**2 + b**2 - 2 * a * b * np.cos(theta + phi_0))
    return length, a * b * np.sin(theta + phi_0) / length


def rates(x, u, payload=0.0, more_friction=0.0):
    """With a mass at the tip in kg, and more dry friction in the cylinder in N."""
    theta, omega, *gas = x
    length, r = geometry(theta)
    y, v = length - L_MIN, r * omega
    force, gas_rates = rig.cylinder(y, v, *gas, u, stroke=STROKE)
    force += rig.stop(y, v, *(geometry(end)[0] - L_MIN for end in RANGE))
    force -= more_friction * np.tanh(rig.K_TANH * v)
    moment = M_L * L_C + payload * LENGTH
    torque = r * force - moment * G * np.cos(theta) - B_J * omega
    return np.array([omega, torque / (J + payload * LENGTH**2), *gas_rates])

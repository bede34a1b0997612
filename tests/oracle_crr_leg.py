"""The leg of paper 001, flat, to be read next to physics.md 2.3.

The cylinders are the rig's (oracle_crr_rig), their geometry the arm's (oracle_crr_arm).  M and G
are the printed closed forms; C comes from the Christoffel symbols with the derivatives of M by
complex steps.  x = [q (3), q' (3), (P_c, m_c, P_r, m_r) of each cylinder].
"""

import numpy as np
import oracle_crr_arm as arm
import oracle_crr_rig as rig

INCH, G = 0.0254, 9.81
D1, A1, A2, A3 = 1.608 * INCH, 5.750 * INCH, 6.828 * INCH, 12.00 * INCH
M1, M2, M3 = 1.2, 0.9, 0.5
R1, R2, R3 = 30e-3, 25e-3, 15e-3
IT1, IT2, IT3 = (
    m * (3 * r**2 + length**2) / 12 for m, r, length in ((M1, R1, A1), (M2, R2, A2), (M3, R3, A3))
)
IA2, IA3 = M2 * R2**2 / 2, M3 * R3**2 / 2
GEOMETRY = ((0.14, 0.045, 90.0), (0.15, 0.045, 65.0), (0.17, 0.045, 30.0))
RANGES = np.radians([[-40.0, 40.0], [-25.0, 55.0], [17.0, 95.0]])
STROKE, SHORTEST = 0.0635, (0.1127, 0.1155, 0.1395)  # joint 3 is the arm's


def mass_matrix(q):
    c2, s2 = np.cos(q[1]), np.sin(q[1])
    c3, c23, s23 = np.cos(q[2]), np.cos(q[1] + q[2]), np.sin(q[1] + q[2])
    m11 = (
        M1 * (A1 / 2) ** 2 + IT1
        + M2 * (A1 + A2 / 2 * c2) ** 2 + IT2 * c2**2 + IA2 * s2**2
        + M3 * (A1 + A2 * c2 + A3 / 2 * c23) ** 2 + IT3 * c23**2 + IA3 * s23**2
    )  # fmt: skip
    m22 = M2 * A2**2 / 4 + IT2 + M3 * (A2**2 + A3**2 / 4 + A2 * A3 * c3) + IT3
    m23 = M3 * (A3**2 / 4 + A2 * A3 / 2 * c3) + IT3
    m33 = M3 * A3**2 / 4 + IT3
    return np.array([[m11, 0, 0], [0, m22, m23], [0, m23, m33]])


def gravity(q):
    c2, c23 = np.cos(q[1]), np.cos(q[1] + q[2])
    shank = M3 * A3 / 2 * c23
    return -G * np.array([0.0, M2 * A2 / 2 * c2 + M3 * A2 * c2 + shank, shank])


def coriolis(q, qd):
    """C q' with c_ijk = (dM_ij/dq_k + dM_ik/dq_j - dM_jk/dq_i) / 2."""
    slopes = [np.imag(mass_matrix(q + 1e-30j * e)) / 1e-30 for e in np.eye(3)]
    bias = np.zeros(3)
    for i, j, k in np.ndindex(3, 3, 3):
        bias[i] += (slopes[k][i, j] + slopes[j][i, k] - slopes[i][j, k]) / 2 * qd[j] * qd[k]
    return bias


def energy(q, qd):
    """Kinetic and potential, the links' centres by their heights."""
    s2, s23 = np.sin(q[1]), np.sin(q[1] + q[2])
    heights = D1, D1 - A2 / 2 * s2, D1 - A2 * s2 - A3 / 2 * s23
    return 0.5 * qd @ mass_matrix(q) @ qd + G * np.dot((M1, M2, M3), heights)


def dh_foot(q):
    """Foot by the product of transforms, modified (Craig) parameters with a fixed frame 4."""
    T = np.eye(4)
    rows = zip((0, -np.pi / 2, 0, 0), (0, A1, A2, A3), (D1, 0, 0, 0), (*q, 0.0), strict=True)
    for alpha, a, d, theta in rows:
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        T = T @ np.array(
            [
                [c, -s, 0, a],
                [s * ca, c * ca, -sa, -sa * d],
                [s * sa, c * sa, ca, ca * d],
                [0, 0, 0, 1],
            ]
        )
    return T[:3, 3]


def joint(number, theta):
    """Position of the rod, its lever, and the positions at both ends of the range."""
    a, b, phi_0 = GEOMETRY[number]
    low, high = (arm.geometry(end, a, b, np.radians(phi_0))[0] for end in RANGES[number])
    length, r = arm.geometry(theta, a, b, np.radians(phi_0))
    shortest = SHORTEST[number]
    return length - shortest, r, (low - shortest, high - shortest)


def rates(x, u):
    q, qd = x[:3], x[3:6]
    torque, gas_rates = np.zeros(3), []
    for n in range(3):
        y, r, ends = joint(n, q[n])
        gas = x[6 + 4 * n : 10 + 4 * n]
        force, of_gas = rig.cylinder(y, r * qd[n], *gas, u[n], stroke=STROKE)
        torque[n] = r * (force + rig.stop(y, r * qd[n], *ends))
        gas_rates.extend(of_gas)
    qdd = np.linalg.solve(mass_matrix(q), torque - coriolis(q, qd) - gravity(q))
    return np.concatenate([qd, qdd, gas_rates])

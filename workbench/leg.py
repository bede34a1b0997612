"""The rigid body of a leg with three joints: kinematics, inertia, Coriolis, weight.

Joint 1 turns the leg about the vertical, joints 2 and 3 move it in its own plane.

Source: paper 001, DH table; physics.md 2.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.effect import (
    Balance,
    Cause,
    Conditions,
    Expression,
    Part,
    Received,
    form,
    strength,
)

JOINTS = 3
INCH_M = 0.0254


@dataclass(frozen=True)
class LegGeometry:
    """Lengths of the leg in m; angles count from the straight, horizontal leg.

    X = cos th1 (a1 + a2 c2 + a3 c23),  Y = sin th1 (a1 + a2 c2 + a3 c23),
    Z = d1 - a2 s2 - a3 s23

    Source: paper 001, DH table in inches.  Each row holds theta, d, alpha and a of the same link,
    with fixed frames before and after, and alpha_3 = 0 (erratum E001-6).
    """

    offset_m: Expression = 1.608 * INCH_M  # d1
    shoulder_m: Expression = 5.750 * INCH_M  # a1
    thigh_m: Expression = 6.828 * INCH_M  # a2
    shank_m: Expression = 12.00 * INCH_M  # a3

    def foot_m(self, angles_rad: Sequence[Expression]) -> tuple[Expression, ...]:
        """Position of the foot (X, Y, Z) at three angles."""
        first, second, third = angles_rad
        both = second + third
        out = self.shoulder_m + self.thigh_m * ca.cos(second) + self.shank_m * ca.cos(both)
        height = self.offset_m - self.thigh_m * ca.sin(second) - self.shank_m * ca.sin(both)
        return out * ca.cos(first), out * ca.sin(first), height

    def angles_rad(self, foot_m: Sequence[float], bend: int = 1) -> np.ndarray:
        """Angles that put the foot there, shape (3,); ``bend`` +1 or -1 picks the knee's side.

        th1 = atan2(Y, X),  rho = sqrt(X^2 + Y^2) - a1,  h = d1 - Z
        D = (rho^2 + h^2 - a2^2 - a3^2) / (2 a2 a3),     th3 = atan2(+-sqrt(1 - D^2), D)
        th2 = atan2(h, rho) - atan2(a3 sin th3, a2 + a3 cos th3)

        Raises
        ------
        ValueError
            If the foot cannot reach that far, or not that near.
        """
        x, y, z = foot_m
        a2, a3 = self.thigh_m, self.shank_m
        rho, h = np.hypot(x, y) - self.shoulder_m, self.offset_m - z
        cosine = (rho**2 + h**2 - a2**2 - a3**2) / (2.0 * a2 * a3)
        if abs(cosine) > 1.0:
            raise ValueError(
                f"the foot cannot be at ({x:g}, {y:g}, {z:g}) m, {np.hypot(rho, h):.4g} m from "
                f"joint 2; expected {abs(a2 - a3):.4g} to {a2 + a3:.4g} m"
            )
        third = np.arctan2(bend * np.sqrt(1.0 - cosine**2), cosine)
        second = np.arctan2(h, rho) - np.arctan2(a3 * np.sin(third), a2 + a3 * np.cos(third))
        return np.array([np.arctan2(y, x), second, third])


@dataclass(frozen=True, kw_only=True)
class Leg(Part):
    """Three links, solid cylinders with their centres at half length, and a payload at the foot.

    M(q) q'' + C(q, q') q' + G(q) = tau

    with M as printed in physics.md 2.3, to which a point mass at the foot is added, and C from the
    Christoffel symbols of M:  C q' = d(M q')/dq q' - 1/2 d(q' M q')/dq.  G is an effect of its own.
    A payload is an effect, too, and no shift of the shank's mass, whose centre is at half length.

    Source: paper 001 (the engine's solid cylinders); physics.md 2.3: masses and radii are chosen.
    """

    causes = (
        Cause(
            name="added_mass",
            strength="added_mass_kg",
            balance=Balance.MOMENTUM,
            drivers=("acceleration", "angle"),
            shown_by="slow sweep of each joint, and fast steps",
            source="physics.md section 6 (payload)",
        ),
    )

    joints: tuple[str, str, str]
    shoulder_mass_kg: Expression = form(1.2, lower=1e-3, relative_deviation=0.05)
    thigh_mass_kg: Expression = form(0.9, lower=1e-3, relative_deviation=0.05)
    shank_mass_kg: Expression = form(0.5, lower=1e-3, relative_deviation=0.05)
    added_mass_kg: Expression = strength(typical=0.3, upper=3.0)
    offset_m: Expression = form(1.608 * INCH_M, lower=-1.0, upper=1.0)
    shoulder_length_m: Expression = form(5.750 * INCH_M, lower=1e-3)
    thigh_length_m: Expression = form(6.828 * INCH_M, lower=1e-3)
    shank_length_m: Expression = form(12.00 * INCH_M, lower=1e-3)
    shoulder_radius_m: Expression = form(30e-3)
    thigh_radius_m: Expression = form(25e-3)
    shank_radius_m: Expression = form(15e-3)

    @property
    def geometry(self) -> LegGeometry:
        lengths = (self.shoulder_length_m, self.thigh_length_m, self.shank_length_m)
        return LegGeometry(self.offset_m, *lengths)

    def mass_matrix(self, angles_rad: Sequence[Expression]) -> ca.SX:
        """M(q), shape (3, 3), in kg m2."""
        _, second, third = angles_rad
        c2, c3, c23 = ca.cos(second), ca.cos(third), ca.cos(second + third)
        m1, m2, m3, foot = (
            self.shoulder_mass_kg,
            self.thigh_mass_kg,
            self.shank_mass_kg,
            self.added_mass_kg,
        )
        a1, a2, a3 = self.shoulder_length_m, self.thigh_length_m, self.shank_length_m
        (t1, _), (t2, x2), (t3, x3) = self._own_inertias()
        knee, end = a1 + a2 * c2, a1 + a2 * c2 + a3 * c23
        m11 = m1 * (a1 / 2) ** 2 + t1
        m11 += m2 * (a1 + a2 / 2 * c2) ** 2 + t2 * c2**2 + x2 * (1 - c2**2)
        m11 += m3 * (knee + a3 / 2 * c23) ** 2 + t3 * c23**2 + x3 * (1 - c23**2) + foot * end**2
        m33 = m3 * a3**2 / 4 + t3 + foot * a3**2
        m23 = m33 + (m3 / 2 + foot) * a2 * a3 * c3
        m22 = m2 * a2**2 / 4 + t2 + (m3 + foot) * a2**2 + 2 * m23 - m33
        return ca.blockcat([[m11, 0, 0], [0, m22, m23], [0, m23, m33]])

    def _own_inertias(self) -> tuple[tuple[Expression, Expression], ...]:
        """Of each link about its centre: across, m (3 r^2 + L^2)/12, and along its axis."""
        links = (
            (self.shoulder_mass_kg, self.shoulder_radius_m, self.shoulder_length_m),
            (self.thigh_mass_kg, self.thigh_radius_m, self.thigh_length_m),
            (self.shank_mass_kg, self.shank_radius_m, self.shank_length_m),
        )
        return tuple((m * (3 * r**2 + length**2) / 12, m * r**2 / 2) for m, r, length in links)

    def coriolis(self, angles_rad: ca.SX, velocities_rad_s: ca.SX) -> ca.SX:
        """C(q, q') q', shape (3, 1), in N m."""
        q, speed = ca.SX.sym("q", JOINTS), ca.SX.sym("speed", JOINTS)
        momentum = self.mass_matrix(ca.vertsplit(q)) @ speed
        twice_energy = ca.dot(speed, momentum)
        bias = ca.jacobian(momentum, q) @ speed - 0.5 * ca.gradient(twice_energy, q)
        return ca.substitute([bias], [q, speed], [angles_rad, velocities_rad_s])[0]

    def derive(self, now: Conditions) -> dict[str, Expression]:
        angles = [now[joint].angle_rad for joint in self.joints]
        second, both = angles[1], angles[1] + angles[2]
        thigh = (
            self.thigh_mass_kg / 2 + self.shank_mass_kg + self.added_mass_kg
        ) * self.thigh_length_m
        shank = (self.shank_mass_kg / 2 + self.added_mass_kg) * self.shank_length_m
        moments = {}
        for key, wave in (("along", ca.cos), ("across", ca.sin)):
            lower = -shank * wave(both)
            moments[f"{self.joints[1]}_{key}_kg_m"] = lower - thigh * wave(second)
            moments[f"{self.joints[2]}_{key}_kg_m"] = lower
        x_m, y_m, z_m = self.geometry.foot_m(angles)
        return moments | {"foot_x_m": x_m, "foot_y_m": y_m, "foot_z_m": z_m}

    def close(self, now: Conditions, received: Received) -> dict[str, Expression]:
        q, speed, torque = (
            ca.vertcat(*(getattr(now[joint], key) for joint in self.joints))
            for key in ("angle_rad", "velocity_rad_s", "torque_n_m")
        )
        M = self.mass_matrix(ca.vertsplit(q))
        free = torque - self.coriolis(q, speed)
        determinant = M[1, 1] * M[2, 2] - M[1, 2] ** 2
        accelerations = (
            free[0] / M[0, 0],
            (M[2, 2] * free[1] - M[1, 2] * free[2]) / determinant,
            (M[1, 1] * free[2] - M[1, 2] * free[1]) / determinant,
        )
        return {
            f"{joint}_acceleration_rad_s2": value
            for joint, value in zip(self.joints, accelerations, strict=True)
        }

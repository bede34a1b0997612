"""The friction bench of the printed cylinders: a force sensor pushes the rod while it is moved.

Nothing is integrated: pressure, position and velocity of the rod are measured inputs and the force
is compared sample by sample.  The velocity comes from the recorded position by the differentiator
of :mod:`workbench.differentiator`.

The position counts inwards, against the pressure, as the bench records it: so the sensor reads
F = (p - p_atm) A + friction where the rod moves in, and minus friction where it moves out.

The plant is bare, F = (p - p_atm) A; what it may lack stands at null.  An offset of the force
sensor would be the same as a constant force here and is not listed a second time.

Source: physics.md 2.7 and the data set printed_cylinder (bore 25.7 mm for the files with 257 in
their name, 25 mm for the others).  sign(v) is tanh(v / 1 mm/s), as the data set's table has it.
"""

from __future__ import annotations

from math import pi

from workbench.effects import ConstantForce, SpringForce, StribeckFriction
from workbench.parts import Atmosphere, HeldRod, PressureFace
from workbench.plant import Plant, Signal

BORE_M = 25.7e-3
MIDDLE_M = 0.017  # of the recorded strokes
STEEPNESS_S_M = 1000.0
ATMOSPHERE_PA = 1.013e5


def cylinder_bench() -> Plant:
    """The bench without friction."""
    return Plant(
        name="cylinder_bench",
        parts=(
            Atmosphere(name="atmosphere", pressure_pa=ATMOSPHERE_PA),
            HeldRod(name="rod"),
            PressureFace(name="chamber", body="rod", side=-1, area_m2=pi / 4 * BORE_M**2),
        ),
        effects=(
            StribeckFriction(
                name="friction",
                body="rod",
                chambers=("chamber",),
                steepness_s_m=STEEPNESS_S_M,
                stribeck_velocity_m_s=0.005,  # strokes of 15 mm/s would not show a wider peak
            ),
            ConstantForce(name="constant_force", body="rod"),
            SpringForce(name="spring_force", body="rod", rest_m=MIDDLE_M),
        ),
        measured_inputs=(
            Signal("chamber.pressure_pa", nominal=ATMOSPHERE_PA + 5e5, lower=0.0),
            Signal("rod.position_m", nominal=MIDDLE_M),
            Signal("rod.velocity_m_s", nominal=0.0),
        ),
        measured=("rod.force_n",),
    )

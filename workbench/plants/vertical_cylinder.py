"""A vertical cylinder that throws its rod up by kicks of pressure and lets it sink again.

M dv/dt = (p - p_atm) A - M g + stops, with the chamber pressure as a measured input and the rod
side at ambient.  The plant is bare; friction and what else it may lack stand at null.

Source: physics.md 2.7 and the data set vertical_cylinder: moving mass 1.469 kg, piston 25 mm, upper
stop near 107.8 mm, lower stop at 0.  The stops are stiff; their numbers are *chosen*.
"""

from __future__ import annotations

from math import pi

from workbench.effects import (
    ConstantForce,
    EndCushion,
    EndStops,
    PositionSensorOffset,
    SpringForce,
    StribeckFriction,
    Weight,
)
from workbench.parts import Atmosphere, Body, PressureFace
from workbench.plant import Plant, Signal

MASS_KG = 1.469
PISTON_M = 25e-3
UPPER_STOP_M = 0.1078
ATMOSPHERE_PA = 1.013e5
STEEPNESS_S_M = 1000.0
REST_M = 0.017  # where the kicks begin


def vertical_cylinder() -> Plant:
    """The cylinder without friction."""
    return Plant(
        name="vertical_cylinder",
        parts=(
            Atmosphere(name="atmosphere", pressure_pa=ATMOSPHERE_PA),
            Body(name="rod", mass_kg=MASS_KG, initial_position_m=REST_M),
            PressureFace(name="chamber", body="rod", area_m2=pi / 4 * PISTON_M**2),
        ),
        effects=(
            Weight(name="weight", body="rod"),
            EndStops(name="stops", body="rod", stiffness_n_m=2e6, upper_m=UPPER_STOP_M),
            StribeckFriction(
                name="friction", body="rod", chambers=("chamber",), steepness_s_m=STEEPNESS_S_M
            ),
            ConstantForce(name="constant_force", body="rod"),
            SpringForce(name="spring_force", body="rod", rest_m=UPPER_STOP_M / 2),
            EndCushion(name="end_cushion", body="rod", stroke_m=UPPER_STOP_M),
            PositionSensorOffset(name="sensor_offset@rod.position", signal="rod.position_m"),
        ),
        measured_inputs=(Signal("chamber.pressure_pa", nominal=ATMOSPHERE_PA, lower=0.0),),
        measured=("rod.position_m",),
        optional_outputs=("rod.velocity_m_s",),
    )

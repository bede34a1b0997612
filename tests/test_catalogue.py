"""Where the causes of the catalogue sit (interface.md section 6)."""

import pytest

from workbench.plants import PLANTS
from workbench.units import public_name

DRIVEN = ("servo_drive", "crr_rig", "crr_arm", "crr_leg")  # a spool valve on a cylinder
SPOOLS = (*DRIVEN, "servo_reservoir", "soft_joint")
GASES = (*SPOOLS, "gearbox")
PLACES = {  # causes that a plant with such a thing may lack, whatever its file says
    DRIVEN: ("piston_leak", "viscous_friction", "coulomb_friction", "stiction", "presliding",
             "friction_asymmetry", "friction_position", "friction_pressure", "friction_thermal",
             "constant_force", "spring_force", "end_cushion", "dead_volume"),
    SPOOLS: ("valve_offset", "valve_dead_zone", "valve_hysteresis", "valve_stuck_band",
             "valve_lag"),
    GASES: ("command_delay", "line_delay", "spool_leak", "exhaust_restriction",
            "supply_restriction", "discharge_asymmetry", "supply_droop", "chamber_leak"),
    (*GASES, "soft_joint_parametric"): ("sensor_lag", "sensor_scale", "sensor_offset"),
}  # fmt: skip


@pytest.mark.parametrize(
    ("plant_name", "cause"),
    [(plant, cause) for plants, causes in PLACES.items() for plant in plants for cause in causes],
)
def test_a_cause_sits_on_every_plant_that_has_what_it_acts_on(plant_name, cause):
    assert cause in {c.cause.name for c in PLANTS[plant_name]().candidates.values()}


def test_every_sensor_may_be_late_scaled_or_offset():
    for name in (*GASES, "soft_joint_parametric"):
        plant = PLANTS[name]()
        for signal in plant.measured:
            for cause in ("sensor_lag", "sensor_scale", "sensor_offset"):
                assert f"{cause}@{public_name(signal)}" in plant.candidates, (name, signal)

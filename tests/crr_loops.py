"""Closed loops of the rig and the arm for tests: their sensors, their filter, their references."""

from math import radians

import numpy as np

from controllers.axis import axis_of
from controllers.motion import MotionLimits
from estimators.ahead import in_time
from estimators.extended_kalman import ExtendedKalman
from workbench.closed_loop import Hardware, close_loop
from workbench.filtering import consistent_start

DT = 1e-3
POSITION_NOISE = {"crr_rig": 5e-5, "crr_arm": radians(0.05)}
SPEED_NOISE = {"crr_rig": 0.1, "crr_arm": 5.0}
FLOW_NOISE_PA = {"crr_rig": 1e3, "crr_arm": 2e4}  # less lost the arm in one draw of three
PRESSURE_NOISE_PA = 500.0
PRESSURES = {"cap.pressure_pa": 1e6, "rod_side.pressure_pa": 1e6}
RIG = {"rod.position_m": 1e-3, "rod.velocity_m_s": 0.1, **PRESSURES, "valve.command_v": 1.0}
ARM = {
    "joint.angle_rad": radians(1.0),
    "joint.velocity_rad_s": 2.0,
    **PRESSURES,
    "valve.command_v": 1.0,
}
TURNS = {"turn_speed": 0.1, "limits": MotionLimits(speed=8.0, acceleration=100.0, jerk=3e3)}
"""Weights by signal name, and when a reference of the joint has jumped."""


def sensors(plant):
    """Standard deviations of physics.md section 2."""
    pressures = dict.fromkeys(plant.measured[1:], PRESSURE_NOISE_PA)
    return {plant.measured[0]: POSITION_NOISE[plant.name], **pressures}


def kalman(plant):
    """The extended filter of the plant, which foresees the delay of its commands."""
    axis = axis_of(plant)
    process = {
        axis.velocity: SPEED_NOISE[plant.name],
        **dict.fromkeys(axis.pressures, FLOW_NOISE_PA[plant.name]),
    }
    found = ExtendedKalman(
        plant=plant,
        sample_time_s=DT,
        measurement_noise=sensors(plant),
        process_noise=process,
    )
    return in_time(found, plant)


def followed(plant, controller, reference, estimator=None):
    """The record of a run from rest at the start of the reference, with noise and converter."""
    name = plant.measured[0]
    return close_loop(
        plant,
        controller,
        estimator or kalman(plant),
        {name: reference},
        initial=consistent_start(plant, {name: reference[0]}),
        hardware=Hardware(noise=sensors(plant)),
    )


def error_of(record, plant, after=400):
    """Position less reference, from a sample on."""
    name = plant.measured[0]
    return (record.recording[name] - record.recording[f"reference.{name}"])[after:]


def rms(error):
    return float(np.sqrt(np.mean(error**2)))

"""The plants of the papers.  A new plant is one file here and one line below."""

from workbench.plants.closed_chamber import closed_chamber
from workbench.plants.crr_arm import crr_arm
from workbench.plants.crr_leg import crr_leg
from workbench.plants.crr_rig import crr_rig
from workbench.plants.cylinder_bench import cylinder_bench
from workbench.plants.gearbox import gearbox
from workbench.plants.servo_drive import servo_drive
from workbench.plants.servo_reservoir import servo_reservoir
from workbench.plants.soft_joint import soft_joint
from workbench.plants.soft_joint_parametric import soft_joint_parametric
from workbench.plants.vertical_cylinder import vertical_cylinder

PLANTS = {
    "servo_drive": servo_drive,
    "gearbox": gearbox,
    "vertical_cylinder": vertical_cylinder,
    "cylinder_bench": cylinder_bench,
    "crr_rig": crr_rig,
    "crr_arm": crr_arm,
    "crr_leg": crr_leg,
    "closed_chamber": closed_chamber,
    "servo_reservoir": servo_reservoir,
    "soft_joint": soft_joint,
    "soft_joint_parametric": soft_joint_parametric,
}

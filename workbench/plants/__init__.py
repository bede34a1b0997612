"""The plants of the papers.  A new plant is one file here and one line below."""

from workbench.plants.servo_drive import servo_drive

PLANTS = {"servo_drive": servo_drive}

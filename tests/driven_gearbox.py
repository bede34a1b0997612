"""Commands with which tests drive a gearbox: long shifts, a few pulses, valves held in between."""

from studies.gearbox_driving import manoeuvre
from studies.truth.gearbox_manoeuvre import validation_command

DRIVEN = manoeuvre(validation_command, 1).part(0, 2500)

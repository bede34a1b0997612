"""The identification procedures of paper 002: guided fits on dedicated recordings.

Each procedure is a plain function (rig, recordings) -> result in a file of its own, and fits the
rig's own plant: no physics stands here.  A new one is one file and one line below.

Source: paper 002, section 4; physics.md 5, rows S002-1 to S002-7.
"""

from workbench.identification import dead_volume, dead_zone, friction, tank_curves, wall_heat

PROCEDURES = {
    each.PROCEDURE.name: each.PROCEDURE
    for each in (dead_zone, tank_curves, dead_volume, wall_heat, friction)
}
"""In the order in which they are to be done: what a later one needs, an earlier one finds."""

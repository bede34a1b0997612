"""The one-axis rig of papers 000 and 001: a proportional valve and a small cylinder with a mass.

Full level: pressures and gas masses as states, nozzle flow from a continuous input pressure through
a hole that never closes, Stribeck friction; what the papers compare it with are other values or
laws of the same effects:

* linear area and fixed pressures: the valve's area_shape_share, underlap_v and clearance_m at 0;
* two flows of an underlapped spool: ``underlap=TwoFlows()`` of the valve;
* viscous friction alone: coulomb_force_n and stiction_excess_n at 0; LuGre and elasto-plastic
  friction: presliding_share 1 and the bristle's ``plasticity``;
* polytropic and isothermal gas: :mod:`workbench.polytropic`.

Erratum E000-9: paper 000's better model has no smaller RMSE on the rig; it shows in pressures, near
the valve's offset and on the joint.  Values and more errata: :mod:`workbench.plants.crr_cylinder`.
"""

from __future__ import annotations

from workbench.effects import EndStops, SupplyDroop
from workbench.effects.sensors import sensor_flaws
from workbench.parts import Body
from workbench.plant import Plant, Signal
from workbench.plants.crr_cylinder import SUPPLY_PA, CrrCylinder, network, surroundings

STROKE_M = 0.1524
CYLINDER = CrrCylinder(stroke_m=STROKE_M, start_m=STROKE_M / 2)
OUTPUTS = ("rod.position_m", *CYLINDER.pressures)
NETWORK = (CYLINDER.command.name, *OUTPUTS)


def crr_rig() -> Plant:
    """The rig as paper 000 models it; what it may lack stands at null."""
    return Plant(
        name="crr_rig",
        parts=(
            *surroundings(),
            Body(name="rod", mass_kg=1.0, initial_position_m=CYLINDER.start_m),
            *CYLINDER.parts(),
        ),
        effects=(
            *CYLINDER.effects(),
            EndStops(name="stops", body="rod", stiffness_n_m=2e6, upper_m=STROKE_M),
            SupplyDroop(name="supply_droop"),
            *network(OUTPUTS, NETWORK),
            *sensor_flaws({OUTPUTS[0]: CYLINDER.start_m}),
        ),
        commands=(CYLINDER.command,),
        optional_inputs=(Signal("supply.pressure_pa", nominal=SUPPLY_PA),),
        measured=OUTPUTS,
        optional_outputs=("rod.velocity_m_s",),
    )

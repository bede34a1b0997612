"""What is said of a recording that the plant does not follow, however sure the values look."""

from dataclasses import replace

import numpy as np
import pytest

from studies import identification as study
from studies.identification_text import doubts, identification_document
from studies.truth import dedicated as truth
from workbench.identification import PROCEDURES
from workbench.identification.dead_zone import dead_zone
from workbench.identification.result import Curve, Identified
from workbench.identification.tank_curves import tank_curves
from workbench.identification.wall_heat import wall_heat
from workbench.rig import load_rig

TANK, DRIVE = load_rig(study.WRONG_TANK), load_rig(study.WRONG_DRIVE)
ZONE = {
    "valve_dead_zone.centre_v": 4.95,
    "valve_dead_zone.half_width_v": 0.42,
    "valve.leak_area_m2": 8e-8,
}
KNOWN = replace(TANK, plant=TANK.plant.with_values(ZONE), deviations=dict.fromkeys(ZONE, 1e-9))
COMMANDS_V = np.array([3.0, 5.0, 6.0, 8.0, 10.0])


class Leaking(truth.Tank):
    """A tank that a fitting leaves open by a quarter of the spool's leak."""

    def network(self, command_v, columns):
        net = super().network(command_v, columns)
        outside = (self.ambient_pa, truth.ROOM_K)

        def flows(t, pressure, temperature):
            mass, heat = net.flows(t, pressure, temperature)
            lost, carried = truth.passed(-2e-8, truth.LEAK, (pressure, temperature), outside)
            return mass + lost, heat + carried

        return replace(net, flows=flows)


def sweep(tank=study.TANK):
    """A quicker sweep than the study's: 8 s."""
    return study.recording(truth.static_map(tank, seed=2, period_s=8.0), "map")


def read_higher(recording, by_pa):
    """The recording of a tank whose sensor has an offset."""
    channels = {**recording.channels}
    channels["reservoir.pressure_pa"] = channels["reservoir.pressure_pa"] + by_pa
    return replace(recording, channels=channels)


def not_followed(procedure, found):
    """Whether text and JSON say that the plant does not follow the recording."""
    said = doubts(PROCEDURES[procedure], found)
    document = identification_document(PROCEDURES[procedure], found)
    assert document["warnings"] == said
    return any("does not follow" in each and "offset of a sensor" in each for each in said)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (sweep, False),
        (lambda: read_higher(sweep(), 5e3), True),
        (lambda: read_higher(sweep(), -5e3), True),
        (lambda: sweep(Leaking()), True),
    ],
)
def test_a_map_that_a_leak_or_an_offset_bends_is_doubted_and_a_good_one_not(made, said):
    """The limits came out up to 25 mV off, and nothing was said."""
    assert not_followed("dead-zone", dead_zone(TANK, [made()])) is said


@pytest.mark.parametrize(("by_pa", "said"), [(0.0, False), (1e4, True), (-1e4, True)])
def test_tank_curves_of_a_sensor_with_an_offset_are_doubted(by_pa, said):
    curves = study.named(truth.tank_curves(study.TANK, COMMANDS_V, seed=1), "curve")
    found = tank_curves(KNOWN, [read_higher(each, by_pa) for each in curves])

    assert not_followed("flow", found) is said


def test_decays_that_the_heat_law_follows_are_not_doubted():
    """The exponential of the paper's chain lies off by its nature, and is not counted."""
    name = "chamber_a.dead_volume_m3"
    plant = DRIVE.plant.with_values({name: study.DRIVE.dead_volume_a_m3})
    found = wall_heat(
        replace(DRIVE, plant=plant, deviations={name: 1e-7}), study.recordings_of_heat()
    )

    assert not not_followed("wall-heat", found)
    assert [np.isnan(curve.misfit) for curve in found.curves] == [True, False] * 2


def test_the_misfit_of_a_curve_is_its_error_in_deviations_of_the_noise():
    along = np.arange(4.0)
    curve = Curve(label="a", along=along, measured=along, fitted=along + 2.0, noise=0.5)
    found = Identified(rig=DRIVE, estimates=(), parameters=(), curves=(curve,) * 2)

    assert curve.misfit == 4.0
    assert not_followed("flow", found)
    assert not not_followed("flow", replace(found, curves=(replace(curve, noise=1.0),)))

"""Diagnoses of spoiled recordings of the demo: none gets a confident wrong name."""

import pytest
from other_drive import recorded
from test_adversarial_recordings import assert_unnamed, demo  # noqa: F401  (demo: a fixture)

from studies import adversarial as spoil
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.result import NAMING, Verdict
from workbench.rig import default_rig

A, B, PLACE = spoil.A, spoil.B, spoil.PLACE


@pytest.mark.slow
@pytest.mark.parametrize(
    "way", [spoil.SERVO_DRIVE["another command"], spoil.noise(A, B, memory=0.99)]
)
def test_what_nothing_explains_gets_no_name(demo, way):  # noqa: F811
    rig, *recordings = demo
    train, validation = (way(each).part(0, 5000) for each in recordings)

    assert_unnamed(diagnose(rig, [train], [validation], most_windows=12))


@pytest.mark.slow
@pytest.mark.parametrize("sensor", [PLACE, A])
def test_a_stuck_sensor_leads_to_nothing_certain(demo, sensor):  # noqa: F811
    """The demo's hidden effect may still come first, but it is not called found."""
    rig, *recordings = demo
    train, validation = (spoil.stuck(sensor, 3.0)(each).part(0, 5000) for each in recordings)
    found = diagnose(rig, [train], [validation], most_windows=12)

    assert found.verdict is not Verdict.FOUND
    assert found.law is None or found.sentence.endswith("if the recording can be trusted")
    assert any("stuck" in each for each in found.warnings)


@pytest.mark.slow
def test_an_uneven_clock_hides_no_effect_and_makes_none(demo):  # noqa: F811
    rig, *recordings = demo
    way = spoil.SERVO_DRIVE["clock jitter"]
    train, validation = (way(each).part(0, 5000) for each in recordings)
    found = diagnose(rig, [train], [validation], most_windows=12)

    assert found.ranking[0].candidate.name == "piston_leak"
    assert found.verdict in (Verdict.FOUND, Verdict.TIE)


@pytest.fixture(scope="module")
def another_valve():
    """A diagnosis of a drive whose valve opens in another way."""
    train, validation = recorded(11), recorded(12, largest_v=1.0)
    return diagnose(default_rig("servo_drive"), [train], [validation])


@pytest.mark.slow
def test_a_drive_with_another_valve_gets_no_confident_name(another_valve):
    """A twelfth of the position that came 70 ms late had stood in for how its lands open."""
    assert another_valve.verdict not in (Verdict.FOUND, Verdict.TIE)
    assert any("unexplained errors remain" in each for each in another_valve.warnings)
    assert {"valve.flow_area_m2", "valve_dead_zone.half_width_v"} <= {
        each.name for each in another_valve.strained
    }


@pytest.mark.slow
@pytest.mark.xfail(
    strict=True,
    reason="since 8ba3ec7 the dead zone is told as a proxy for 14 %, of what the valve does",
)
def test_a_drive_with_another_valve_gets_no_name(another_valve):
    assert another_valve.verdict not in NAMING

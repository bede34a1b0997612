"""Recordings of one call that carry different channels: what all have is used, and a word said."""

import numpy as np
import pytest

from workbench.consistency import Weight, in_common
from workbench.errors import InputError
from workbench.plant_files import plant_named
from workbench.recording import Recording

DRIVE = plant_named("servo_drive")
PRESSURES = ("chamber_a.pressure_pa", "chamber_b.pressure_pa")


def recorded(name: str, *channels: str) -> Recording:
    return Recording(name, 1e-3, {c: np.zeros(5) for c in ("valve.command_v", *channels)})


@pytest.mark.parametrize("order", [1, -1])
def test_what_only_some_have_is_left_out_whichever_comes_first(order):
    full = recorded("full", *PRESSURES, "slide.position_m", "supply.pressure_pa")
    some = recorded("some", *PRESSURES)

    alike, findings = in_common(DRIVE, [full, some][::order])

    assert all([*each.channels] == ["valve.command_v", *PRESSURES] for each in alike)
    assert {f.channel for f in findings} == {"slide.position", "supply.pressure"}
    assert {f.weight for f in findings} == {Weight.NOTICE}
    assert str(findings[0]) == (
        "full: slide.position: is left out, since some lacks it; what all recordings carry is used"
    )


def test_recordings_that_carry_the_same_stay_as_they_are():
    one, other = recorded("one", *PRESSURES), recorded("other", *PRESSURES)

    alike, findings = in_common(DRIVE, [one, other])

    assert alike[0] is one and alike[1] is other and not findings


def test_a_channel_that_is_no_signal_of_the_plant_may_differ():
    one, other = recorded("one", *PRESSURES, "notes"), recorded("other", *PRESSURES)

    alike, findings = in_common(DRIVE, [one, other])

    assert alike[0] is one and not findings


def test_recordings_without_any_output_in_common_are_refused_by_name():
    one, other = recorded("one", PRESSURES[0]), recorded("other", "slide.position_m")

    with pytest.raises(InputError) as error:
        in_common(DRIVE, [one, other])

    said = str(error.value)
    assert "one has chamber_a.pressure; other has slide.position" in said

"""A recommended recording, made by the independent truth, breaks the tie that it was chosen for."""

import pytest

from studies.hidden_effects import recordings
from studies.next_recording import separate, separation_text
from studies.truth.cases import read_cases


@pytest.mark.slow
def test_the_recommended_recording_tells_a_force_from_every_sensor_on_the_independent_truth():
    """Friction that differs by direction stays: while a slide moves it is a constant force."""
    case = read_cases()["constant_force", 3]
    (pair,) = recordings([case])

    found = separate(case, *pair)

    assert len(found.asked) >= 4, "the case is no crowd to begin with"
    assert set(found.left) <= {"friction_asymmetry"}, separation_text(found)

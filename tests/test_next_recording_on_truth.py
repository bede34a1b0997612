"""A recommended recording, made by the independent truth, breaks the tie that it was chosen for."""

import pytest

from studies.hidden_effects import recordings
from studies.next_recording import separate, separation_text
from studies.truth.cases import read_cases


@pytest.mark.slow
def test_the_recommended_recording_breaks_the_tie_on_the_independent_truth():
    case = read_cases()["constant_force", 3]
    (pair,) = recordings([case])

    found = separate(case, *pair)

    assert found.before.ranking[0].tied_with, "the case is no tie to begin with"
    assert found.broken, separation_text(found)

"""What is doubtful in a recording is doubtful in every round of an improvement."""

from dataclasses import replace

import numpy as np
import pytest
from test_diagnosis import bench, coulomb
from test_improvement import BARE

from workbench.diagnosis.improve import improve
from workbench.diagnosis.result import Verdict
from workbench.reading import RecordingWarning
from workbench.recording import Recording
from workbench.rig import load_rig

FORCE = "rod.force_n"


def clipped(recording: Recording) -> Recording:
    """A force sensor that ends before the force does."""
    force = recording[FORCE]
    top = np.quantile(force, 0.8)
    return replace(recording, channels={**recording.channels, FORCE: np.minimum(force, top)})


def test_no_round_calls_found_what_rests_on_a_saturated_sensor():
    train, held_out = [clipped(bench(1, coulomb))], [clipped(bench(2, coulomb, gauge_pa=4e5))]

    with pytest.warns(RecordingWarning, match="saturated"):
        found = improve(load_rig(BARE), train, held_out)

    assert found.kept == ("coulomb_friction",)
    for diagnosis in found.diagnoses:
        assert any("saturated" in warning for warning in diagnosis.warnings)
        assert diagnosis.verdict is not Verdict.FOUND
    first = found.diagnoses[0]
    assert first.verdict is Verdict.TIE and first.next_recording.separates[0] == "coulomb_friction"

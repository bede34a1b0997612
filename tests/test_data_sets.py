"""What every data set must hold: channels with known names and units, on one uniform grid."""

import re

import numpy as np
import pytest

from workbench.recording_format import channel_names
from workbench.recordings import RECORDINGS, real_data_folder
from workbench.units import si_unit

FOLDER = real_data_folder()
every_data_set = pytest.mark.parametrize(
    "data_set", RECORDINGS, ids=lambda module: module.__name__.rpartition(".")[2]
)


@every_data_set
def test_a_data_set_names_its_source_and_licence(data_set):
    assert "Source:" in data_set.__doc__
    assert re.search(r"\b(CC0|CC BY|MIT|BSD|Apache)", data_set.__doc__)


@pytest.mark.skipif(FOLDER is None, reason="the real recordings are not beside the project")
@pytest.mark.filterwarnings("ignore::workbench.reading.RecordingWarning")
@every_data_set
def test_channels_have_known_names_and_units_on_a_uniform_grid(data_set):
    pairs = data_set.everything(FOLDER)

    assert pairs
    names = [recording.name for _, recording in pairs]
    assert len(set(names)) == len(names)
    for rig, recording in pairs:
        known = channel_names(rig.plant).values()
        assert set(recording.channels) <= set(known)
        assert all(si_unit(name) for name in recording.channels)
        assert 0.0 < recording.sample_time_s < 0.2
        assert {len(values) for values in recording.channels.values()} == {len(recording)}
        assert recording.starts[0] == 0
        assert (np.diff((*recording.starts, len(recording))) > 0).all()
        plant = rig.fit_for(recording)
        for signal in (*plant.commands, *plant.measured_inputs):
            assert np.isfinite(recording[signal.name]).all()

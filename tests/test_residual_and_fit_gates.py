"""The second residual test, and what a recording can tell before a fit."""

import numpy as np
import pytest
from page_files import drive_files

from workbench.comparison.independence import independence
from workbench.fitting.identifiability import identifiability
from workbench.reading import read_recording
from workbench.rig import load_rig


def test_white_noise_is_independent_of_the_input_and_a_late_share_of_it_is_found():
    rng = np.random.default_rng(5)
    e, u = rng.standard_normal((2, 4000))
    slow = np.cumsum(u)
    late = e + 0.2 * np.concatenate([np.zeros(7), u[:-7]])

    white = independence(e, slow, "u", 1e-3, 100)
    found = independence(late, u, "u", 1e-3, 100)

    assert white.outside < 0.1
    assert found.lag_s[np.argmax(found.correlation)] == pytest.approx(7e-3)
    assert found.correlation.max() == pytest.approx(0.2 / np.sqrt(1.04), abs=0.03)
    assert found.band == pytest.approx(1.96 / np.sqrt(4000), rel=0.3)


def test_the_correlation_is_that_of_numpy():
    rng = np.random.default_rng(2)
    e, u = rng.standard_normal((2, 300))
    e, u = e - e.mean(), u - u.mean()

    found = independence(e, u, "u", 0.1, 20)

    whole = np.correlate(e, u, "full") / np.sqrt((e @ e) * (u @ u))
    assert found.correlation == pytest.approx(whole[299 - 20 : 299 + 21])


def test_an_error_without_samples_has_no_correlation():
    found = independence(np.full(9, np.nan), np.arange(9.0), "u", 1.0, 3)

    assert found.correlation.tolist() == [0.0]


def test_a_drive_that_moves_tells_its_mass_and_none_of_the_ambient_pressure(tmp_path):
    drive_files(tmp_path)
    rig = load_rig(tmp_path / "rig.toml")

    known = identifiability(rig, [read_recording(rig, tmp_path / "train.csv")])

    assert "slide.mass_kg" in known.names and "slide.mass_kg" not in known.flat
    assert "atmosphere.pressure_pa" in known.flat
    assert 0 < known.rank <= len(known.names)
    assert (known.share <= 1.0 + 1e-9).all()

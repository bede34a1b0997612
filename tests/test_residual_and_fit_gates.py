"""The second residual test, and what a recording can tell before a fit."""

import numpy as np
import pytest
from page_files import drive_files
from scipy.signal import lfilter

from studies.text import outside_band
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
    assert found.bands.min() == pytest.approx(1.96 / np.sqrt(4000), rel=0.3)


def test_the_band_is_wider_where_error_and_input_are_both_slow():
    """AR(1) with 0.9 both: P = sum of 0.81^|k| = 1.81 / 0.19, its root 3.09; by chance 5 %."""
    rng, n = np.random.default_rng(4), 10_000
    slow = lfilter([1.0], [1.0, -0.9], rng.standard_normal((20, 2, n)))
    found = [independence(e, u, "u", 1e-3, 100) for e, u in slow]

    bands = np.array([each.bands.min() for each in found])
    assert bands.mean() == pytest.approx(np.sqrt(1.81 / 0.19) * 1.96 / np.sqrt(n), rel=0.05)
    assert np.mean([each.outside for each in found]) == pytest.approx(0.05, abs=0.02)


def test_the_correlation_is_that_of_numpy():
    rng = np.random.default_rng(2)
    e, u = rng.standard_normal((2, 300))
    e, u = e - e.mean(), u - u.mean()

    found = independence(e, u, "u", 0.1, 20)

    whole = np.correlate(e, u, "full") / np.sqrt((e @ e) * (u @ u))
    assert found.correlation == pytest.approx(whole[299 - 20 : 299 + 21])


@pytest.mark.parametrize(
    ("error", "values"),
    [
        (np.full(9, np.nan), np.arange(9.0)),
        (np.sin(np.arange(400.0)), np.full(400, 4.95)),
        (np.full(400, 0.1), np.arange(400.0)),
    ],
    ids=["no samples", "constant input", "constant error"],
)
def test_without_anything_to_correlate_independence_is_not_known(error, values):
    """None of the lags outside the band would read as an error that is independent."""
    found = independence(error, values, "u", 1.0, 3)

    assert not len(found.correlation) and not len(found.lag_s)
    assert np.isnan(found.outside)
    assert outside_band(found.outside).startswith("not known")


def test_missing_samples_take_nothing_off_the_correlation_with_an_input():
    rng = np.random.default_rng(6)
    e, u = rng.standard_normal((2, 8000))
    late = e + np.concatenate([np.zeros(3), u[:-3]])
    whole = independence(late, u, "u", 1e-3, 20)
    late[::4] = np.nan
    found = independence(late, u, "u", 1e-3, 20)

    assert whole.correlation[23] == pytest.approx(np.sqrt(0.5), abs=0.03)
    assert found.correlation[23] == pytest.approx(np.sqrt(0.5), abs=0.03)
    assert found.bands[23] == pytest.approx(1.96 / np.sqrt(4000), rel=0.15)


def test_an_error_is_not_held_against_the_input_of_the_piece_before():
    """Behind each gap the error begins with the last ten inputs before it."""
    e, u = np.random.default_rng(7).standard_normal((2, 4000))
    starts = tuple(range(0, 4000, 50))
    for first in starts[1:]:
        e[first : first + 10] = 3.0 * u[first - 10 : first]

    across = independence(e, u, "u", 1e-3, 20)
    found = independence(e, u, "u", 1e-3, 20, starts)

    assert across.correlation[30] > 4.0 * across.bands[30]
    assert (np.abs(found.correlation) < 1.5 * found.bands).all()
    assert found.bands[[20, 30]] == pytest.approx(1.96 / np.sqrt([4000, 3200]), rel=0.15)


def test_lags_that_no_pair_has_are_left_out():
    error = np.sin(np.arange(400.0))
    error[::2] = np.nan

    found = independence(error, np.cos(np.arange(400.0)), "u", 1.0, 4)

    assert found.lag_s.tolist() == [-4.0, -2.0, 0.0, 2.0, 4.0]


def test_a_drive_that_moves_tells_its_mass_and_none_of_the_ambient_pressure(tmp_path):
    drive_files(tmp_path)
    rig = load_rig(tmp_path / "rig.toml")

    known = identifiability(rig, [read_recording(rig, tmp_path / "train.csv")])

    assert "slide.mass_kg" in known.names and "slide.mass_kg" not in known.flat
    assert "atmosphere.pressure_pa" in known.flat
    assert 0 < known.rank <= len(known.names)
    assert (known.share <= 1.0 + 1e-9).all()

"""What a recording could show: sizes from which an effect is seen, and recordings too weak."""

from math import inf

import numpy as np
import pytest
from test_diagnosis import bench, coulomb, nothing
from test_judgement import BARE

from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.power import first_size
from workbench.diagnosis.result import Verdict
from workbench.recording import Recording
from workbench.rig import load_rig


def still(seed):
    """20 s in which nothing moves: a force sensor that shows its noise."""
    moved = bench(seed, nothing)
    noise_n = 0.2 * np.random.default_rng(seed).standard_normal(len(moved))
    held = {
        "chamber.pressure_pa": np.full(len(moved), 4e5),
        "rod.position_m": np.full(len(moved), 0.01),
        "rod.velocity_m_s": np.zeros(len(moved)),
    }
    force_n = (4e5 - 1.013e5) * 5.187e-4 + noise_n
    channels = {**held, "rod.force_n": force_n}
    return Recording(f"still {seed}", 0.01, channels, noise={"rod.force_n": 0.2})


def row_of(found, name):
    return next(row for row in found.ranking if row.candidate.name == name)


@pytest.fixture(scope="module")
def quiet():
    """A diagnosis where strokes were recorded and nothing is missing."""
    recordings = [bench(1, nothing)], [bench(2, nothing, gauge_pa=4e5)]
    return diagnose(load_rig(BARE), *recordings)


def test_what_is_shown_grows_as_the_square_of_the_size():
    assert first_size({0.1: 4.0, 0.3: 36.0}, 9.0) == pytest.approx(0.15)
    assert first_size({0.1: 4.0}, 1.0) == pytest.approx(0.05)
    assert first_size({0.1: 1.0, 0.3: 9.0}, 36.0) == pytest.approx(0.6)


def test_a_kink_does_not_put_the_size_below_one_that_is_known_to_be_blind():
    assert first_size({0.1: 0.0, 0.3: 400.0}, 1.0) == 0.1


def test_what_nothing_shows_is_seen_at_no_size():
    assert first_size({0.1: 0.0, 0.3: 0.0}, 1.0) == inf
    assert first_size({}, 1.0) == inf


def test_a_recording_at_rest_is_too_weak_and_says_for_what():
    found = diagnose(load_rig(BARE), [still(1)], [still(2)])

    assert found.verdict is Verdict.RECORDING_TOO_WEAK
    assert found.best is None
    assert row_of(found, "coulomb_friction").blind
    assert "coulomb_friction" in found.sentence


def test_strokes_without_anything_missing_are_not_too_weak(quiet):
    assert quiet.verdict is not Verdict.RECORDING_TOO_WEAK
    assert not row_of(quiet, "coulomb_friction").blind


@pytest.mark.parametrize(("factor", "seen"), [(2.0, True), (0.3, False)])
def test_an_effect_is_named_from_about_the_size_that_was_foretold(quiet, factor, seen):
    row = row_of(quiet, "coulomb_friction")
    size_n = factor * row.visible_from * 60.0  # its typical size

    def friction(v):
        return size_n / 8.0 * coulomb(v)

    found = diagnose(load_rig(BARE), [bench(1, friction)], [bench(2, friction, gauge_pa=4e5)])

    assert row_of(found, "coulomb_friction").accepted is seen

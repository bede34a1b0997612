"""Where a bench without states fails: its missing force against velocity is the friction curve."""

import numpy as np
import pytest
from test_diagnosis import bench, coulomb, nothing
from test_improvement import BARE

from studies.documents import diagnosis_document
from studies.figures.diagnosis import diagnosis_figures
from studies.page.balance_terms import terms_of
from studies.text_of_results import diagnosis_text
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.where_stateless import of_residual
from workbench.fitting.problem import pose
from workbench.recording import Recording
from workbench.rig import default_rig, load_rig

UNITS = {"rod.force": "rod.force_n"}


@pytest.fixture(scope="module")
def rubbing():
    train, held_out = [bench(1, coulomb), bench(3, coulomb, gauge_pa=1e5)], [bench(2, coulomb)]
    return diagnose(load_rig(BARE), train, held_out)


def test_the_missing_force_jumps_with_the_direction_by_twice_the_dry_friction(rubbing):
    where = rubbing.where
    (curve,) = (each for each in where.against if each.variable == "rod.velocity_m_s")
    velocity, force, _ = curve.bins
    named = rubbing.named.size["friction.coulomb_force_n"].value

    assert where.balance == "rod.momentum" and where.certain
    assert where.against[0] is curve and curve.explains > 0.9
    assert np.mean(force[velocity > 0.002]) - np.mean(force[velocity < -0.002]) == pytest.approx(
        2.0 * named, rel=0.1
    )


def test_its_numbers_are_told_drawn_and_written(rubbing):
    where = diagnosis_document(rubbing, UNITS)["where"]

    assert where["against"][0]["variable"] == "rod.velocity" and where["random_walk"] is None
    assert "missing term of rod.momentum follows rod.velocity" in diagnosis_text(rubbing, UNITS)
    assert "missing_term" in diagnosis_figures(rubbing)
    terms = terms_of(load_rig(BARE), rubbing.base, rubbing.where)
    assert terms == {"rod.momentum": rubbing.where}


def test_samples_that_are_missing_are_left_out_of_it():
    recording = bench(1, coulomb)
    recording.channels["rod.force_n"][100:300] = np.nan
    where = diagnose(load_rig(BARE), [recording], [bench(2, coulomb)]).where
    silent = (where.time_s > recording.sample_time_s * 99.5) & (
        where.time_s < recording.sample_time_s * 299.5
    )

    assert np.isfinite(where.term).all() and len(where.term) == len(recording) - 200
    assert not silent.any()


def test_where_nothing_is_missing_no_balance_is_to_be_blamed():
    found = diagnose(load_rig(BARE), [bench(1, nothing)], [bench(2, nothing)])

    assert not found.where.certain


def test_a_plant_with_states_has_a_smoother_for_it():
    t = 1e-3 * np.arange(500)
    driven = Recording("kick", 1e-3, {
        "chamber.pressure_pa": 1.1e5 + 1e5 * (t > 0.1), "rod.position_m": 0.02 + 0.01 * t,
    }, {"rod.position_m": 1e-4})  # fmt: skip

    assert of_residual(pose(default_rig("vertical_cylinder"), [driven]).base) is None

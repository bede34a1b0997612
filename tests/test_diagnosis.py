"""Diagnosis on a friction bench whose truth is written here in plain numpy."""

from dataclasses import replace

import numpy as np
import pytest

from studies.text_of_results import addition_text
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.improve import accept, add, improve
from workbench.diagnosis.judge import SHARE_REASON
from workbench.diagnosis.result import DecidedBy, Verdict
from workbench.diagnosis.scan import scan
from workbench.diagnosis.ties import alignment
from workbench.fitting.fit import fit
from workbench.fitting.problem import pose
from workbench.recording import Recording
from workbench.rig import load_rig
from workbench.rig_writing import rig_text

AREA_M2 = 5.187e-4
AMBIENT_PA = 1.013e5


def bench(seed, friction, offset_n=0.0, gauge_pa=3e5):
    """20 s of slow strokes at 100 Hz; ``friction`` is a function of velocity in m/s."""
    rng = np.random.default_rng(seed)
    time_s = 0.01 * np.arange(2000)
    phase = 2 * np.pi * (0.13 + 0.01 * seed) * time_s
    x, v = 0.03 * np.sin(phase), 0.03 * np.gradient(np.sin(phase), time_s)
    p = gauge_pa * (1 + 0.1 * np.sin(2 * np.pi * 0.31 * time_s))
    force = p * AREA_M2 + friction(v) + offset_n + 0.2 * rng.standard_normal(len(v))
    channels = {
        "chamber.pressure_pa": p + AMBIENT_PA,
        "rod.position_m": x,
        "rod.velocity_m_s": v,
        "rod.force_n": force,
    }
    return Recording(f"bench {seed}", 0.01, channels, noise={"rod.force_n": 0.2})


def coulomb(v):
    return 8.0 * np.sign(v) * (1 - np.exp(-np.abs(v) / 5e-4))  # another smoothing than the model's


def nothing(v):
    return 0.0 * v


@pytest.fixture(scope="module")
def rig():
    """The bare bench with the bore of these recordings."""
    text = 'name = "bench"\nplant = "cylinder_bench"\n[values]\n"chamber.area" = "518.7 mm^2"\n'
    return load_rig(text)


@pytest.fixture(scope="module")
def found(rig):
    return diagnose(rig, [bench(1, coulomb)], [bench(2, coulomb, gauge_pa=4e5)])


def test_coulomb_friction_is_named_with_its_size(found):
    leader = found.ranking[0]

    assert found.verdict in (Verdict.FOUND, Verdict.TIE)
    assert leader.candidate.name == "coulomb_friction"
    assert leader.size["friction.coulomb_force_n"].value == pytest.approx(8.0, rel=0.05)
    assert leader.drop_train > 0.9
    assert leader.drop_validation > 0.9


def test_every_effect_of_the_plant_stands_in_the_ranking_once(rig, found):
    names = [row.candidate.name for row in found.ranking]

    assert sorted(names) == sorted(rig.plant.candidates)


def test_stiction_is_not_asked_for_without_coulomb_friction(found):
    row = next(row for row in found.ranking if row.candidate.name == "stiction")

    assert row.decided_by is DecidedBy.NOT_APPLICABLE
    assert row.reasons == ("nothing without friction.coulomb_force",)


def test_what_was_not_followed_says_so(found):
    for row in found.ranking:
        assert (row.decided_by is DecidedBy.REFIT) == (row.fit is not None)
        assert row.accepted or row.reasons


@pytest.mark.parametrize("seed", [1, 3, 5])
def test_where_nothing_is_missing_nothing_is_named(rig, seed):
    """No small proxy either: model and truth differ in nothing that one could stand for."""
    found = diagnose(rig, [bench(seed, nothing)], [bench(seed + 1, nothing)])

    assert found.verdict is Verdict.NOTHING_MISSING
    assert found.named is None
    assert not any(row.accepted for row in found.ranking)


def test_what_explains_a_little_and_may_stand_for_something_else_is_a_small_proxy(rig):
    """A force of 12 N that wanders is in no catalogue; 5 N of friction are 15 % of the misfit."""

    def wandering(seed, gauge_pa):
        random = np.random.default_rng(seed + 50).standard_normal(2200)
        slow = np.convolve(random, np.ones(60) / np.sqrt(60), "same")[:2000]
        plain = bench(seed, lambda v: 5.0 * np.sign(v), gauge_pa=gauge_pa)
        force = plain["rod.force_n"] + 12.0 * slow
        return replace(plain, channels={**plain.channels, "rod.force_n": force})

    found = diagnose(rig, [wandering(1, 3e5)], [wandering(2, 4e5)])
    leader = found.ranking[0]

    assert found.verdict is Verdict.SMALL_PROXY
    assert found.named is leader and found.best is None
    assert leader.reasons == (SHARE_REASON,) and 0.1 < leader.drop_train < 0.2
    assert found.sentence.endswith("may stand for something else")


def test_without_validation_the_verdict_is_at_most_a_tie_with_a_warning(rig):
    found = diagnose(rig, [bench(1, coulomb)])

    assert found.verdict is Verdict.TIE
    assert any("held out" in warning for warning in found.warnings)
    assert found.sentence.endswith("judged on the last third of the training recordings")


def test_the_training_recording_is_no_validation(rig):
    found = diagnose(rig, [bench(1, coulomb)], [bench(1, coulomb)])

    assert found.verdict is Verdict.TIE
    assert any("proves nothing" in warning for warning in found.warnings)
    assert found.sentence.endswith("judged on validation that repeats a training recording")


def test_a_diagnosis_changes_nothing_and_says_the_same_twice(rig, found):
    again = diagnose(rig, [bench(1, coulomb)], [bench(2, coulomb, gauge_pa=4e5)])

    assert [r.candidate.name for r in again.ranking] == [r.candidate.name for r in found.ranking]
    assert again.ranking[0].drop_train == found.ranking[0].drop_train


def test_adding_makes_the_error_fall_on_both_recordings(rig):
    train, held_out = [bench(1, coulomb)], [bench(2, coulomb, gauge_pa=4e5)]
    step = add(rig, "coulomb_friction", train, held_out)

    for part in ("train", "validation"):
        before, after = (errors[part]["rod.force"].rmse for errors in (step.before, step.after))
        assert after < 0.2 * before
    assert step.rig.added == ("coulomb_friction",)
    assert step.rig.notes[-1].endswith("in validation")


def test_what_a_diagnosis_puts_first_can_be_accepted_as_it_was_fitted(rig, found):
    step = accept(rig, found)

    fitted = found.ranking[0].size["friction.coulomb_force_n"].value
    assert step.rig.plant.values["friction.coulomb_force_n"] == fitted
    assert step.drop_train == found.ranking[0].drop_train


def test_what_contradicts_the_rig_cannot_be_accepted(rig, found):
    withdrawn = replace(found, contradicted=True, sentence="recording and rig contradict")

    with pytest.raises(ValueError, match="recording and rig contradict"):
        accept(rig, withdrawn)


def test_a_size_far_beyond_typical_is_found(rig):
    """300 N are 14 typical constant forces."""
    step = add(rig, "constant_force", [bench(1, nothing, 300.0)], [bench(2, nothing, 300.0, 4e5)])

    assert step.fit.converged
    assert step.rig.plant.values["constant_force.force_n"] == pytest.approx(-300.0, rel=1e-3)


def test_a_standard_deviation_says_how_far_sizes_scatter(rig):
    name = "friction.coulomb_force_n"
    steps = [
        add(rig, "coulomb_friction", [bench(k, coulomb)], [bench(k + 10, coulomb, gauge_pa=4e5)])
        for k in range(1, 6)
    ]
    scatter = np.std([step.rig.plant.values[name] for step in steps], ddof=1)

    for step in steps:
        assert scatter / 5 < step.rig.deviations[name] < 5 * scatter


def test_the_shape_that_the_scan_found_is_kept_by_the_refit(rig):
    def stribeck(v):
        return coulomb(v) + 6.0 * np.sign(v) * np.exp(-((v / 0.008) ** 2))

    train, held_out = [bench(1, stribeck), bench(3, stribeck)], [bench(2, stribeck)]
    step = add(add(rig, "coulomb_friction", train, held_out).rig, "stiction", train, held_out)

    assert step.rig.plant.values["friction.stribeck_velocity_m_s"] == 0.008
    assert step.rig.plant.values["friction.stiction_excess_n"] == pytest.approx(6.0, rel=0.15)


def test_adding_without_validation_warns_and_improving_refuses(rig):
    with pytest.warns(UserWarning, match="no validation recording"):
        step = add(rig, "coulomb_friction", [bench(1, coulomb)])
    assert step.rig.notes[-1].endswith("in the last third of the training recordings")
    told = addition_text(step, {})
    assert "of the last third of the training recordings" in told
    assert "RMSE without it  with it" in told
    counts = [len(each.windows) for each in (step.fit, step.validation_fit)]
    assert f"{counts[0]} in training, {counts[1]} held out" in told
    with pytest.raises(ValueError, match="needs a validation recording"):
        improve(rig, [bench(1, coulomb)], [])


def test_an_unknown_effect_is_refused_with_the_nearest_name(rig):
    with pytest.raises(KeyError, match="did you mean coulomb_friction"):
        add(rig, "coulomb_fricton", [bench(1, coulomb)])


def test_an_effect_that_is_there_already_is_refused(rig):
    train, held_out = [bench(1, coulomb)], [bench(2, coulomb)]
    step = add(rig, "coulomb_friction", train, held_out)

    with pytest.raises(ValueError, match="has it already"):
        add(step.rig, "coulomb_friction", train, held_out)


def test_improve_finds_both_of_two_effects_and_stops(rig):
    train = [bench(1, coulomb, 5.0), bench(3, coulomb, 5.0, 1e5)]
    found = improve(rig, train, [bench(2, coulomb, 5.0, 4e5)])
    values = found.rig.plant.values

    assert found.steps[0].candidate.name == "coulomb_friction"
    assert len(found.steps) == 2
    assert found.budget[-1][2] < 0.02 * found.budget[1][2]
    assert values["friction.coulomb_force_n"] == pytest.approx(8.0, rel=0.1)


def interrupting(word, times):
    """Progress of a user who stops the work at the so many-th message with a word."""
    heard = []

    def progress(message):
        heard.append(word in message)
        if sum(heard) == times:
            raise KeyboardInterrupt

    return progress


def test_an_interrupt_keeps_the_rounds_that_are_finished(rig):
    train = [bench(1, coulomb, 5.0), bench(3, coulomb, 5.0, 1e5)]
    held_out = [bench(2, coulomb, 5.0, 4e5)]
    found = improve(rig, train, held_out, interrupting("round", 2))

    assert found.stopped
    assert len(found.budget) == 3 and found.budget[2][1] < found.budget[1][1]
    assert [step.candidate.name for step in found.steps] == ["coulomb_friction"]
    assert found.rig.added == ("coulomb_friction",)


def test_an_interrupt_in_the_first_round_ends_the_work(rig):
    with pytest.raises(KeyboardInterrupt):
        improve(rig, [bench(1, coulomb)], [bench(2, coulomb)], interrupting("round", 1))


def test_an_improved_rig_reads_back_as_the_same_model(rig):
    step = add(rig, "coulomb_friction", [bench(1, coulomb)], [bench(2, coulomb)])
    again = load_rig(rig_text(step.rig))

    assert again.plant.values == step.rig.plant.values
    assert again.added == step.rig.added


def test_the_scan_scores_nothing_where_nothing_can_be_gained(rig):
    problem = pose(rig, [bench(1, nothing)], [])
    base = problem.base
    candidates = problem.whole.candidates.values()
    absent = [c for c in candidates if c.held is None]
    profiles = scan(problem.whole, base.windows, base.unknowns, base.point, absent)

    assert all(profile.drop < 0.1 * base.windows.count for profile in profiles)
    assert alignment(profiles[0], profiles[0]) == pytest.approx(1.0)


def test_a_fit_reports_priors_bounds_and_correlations(rig):
    step = add(rig, "coulomb_friction", [bench(1, coulomb)], [bench(2, coulomb)])
    report = fit(step.rig, [bench(3, coulomb)], [bench(2, coulomb)])
    row = next(r for r in report.rows if r.name == "friction.coulomb_force_n")

    assert row.value == pytest.approx(8.0, rel=0.05)
    assert row.deviation < row.prior_deviation
    assert np.allclose(np.diag(report.correlations), 1.0)

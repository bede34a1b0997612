"""Second thoughts on what was accepted, what an improvement says, and pairs of hidden effects."""

import json
from dataclasses import replace

import numpy as np
import pytest
from test_diagnosis import bench, coulomb, nothing

from studies.figures.improvement import budget_figure
from studies.improvement_text import improvement_document, improvement_text
from studies.truth.draw import EFFECTS
from studies.truth.pairs import PAIRS, stored_pair
from workbench.comparison import compare
from workbench.comparison.free_run import free_run_errors
from workbench.diagnosis import improve as improvement
from workbench.diagnosis.addition import add, assembled
from workbench.diagnosis.diagnose import diagnose, silent
from workbench.diagnosis.improve import improve
from workbench.diagnosis.improvement import Change
from workbench.diagnosis.passes import Kept, Passes
from workbench.diagnosis.warned import Warned
from workbench.fitting.errors import per_sample
from workbench.fitting.linearised import Point
from workbench.fitting.posterior import Moved
from workbench.recording import Recording
from workbench.rig import default_rig, load_rig
from workbench.rig_writing import write_rig
from workbench.simulation import simulate

BARE = 'name = "bench"\nplant = "cylinder_bench"\n[values]\n"chamber.area" = "518.7 mm^2"\n'
UNITS = {"rod.force": "rod.force_n"}


@pytest.fixture(scope="module")
def rig():
    return load_rig(BARE)


@pytest.fixture(scope="module")
def sets():
    """Coulomb friction and a constant force of 5 N, to train on and to hold out."""
    train = [bench(1, coulomb, 5.0), bench(3, coulomb, 5.0, 1e5)]
    return train, [bench(2, coulomb, 5.0, 4e5)]


@pytest.fixture(scope="module")
def improved(rig, sets):
    return improve(rig, *sets)


def steps_of(rig, sets, *names):
    """Additions one after the other, as rounds would have accepted them."""
    steps = ()
    for name in names:
        steps += (add(assembled(rig, steps), name, *sets),)
    return Kept(steps, steps[-1].fit, steps[-1].validation_fit)


def test_an_improvement_thinks_again_and_keeps_what_is_needed(improved):
    assert improved.kept == tuple(step.candidate.name for step in improved.steps)
    assert [each.candidate.name for each in improved.removals] == list(improved.kept)
    assert not any(each.dropped for each in improved.removals)
    assert improved.swaps and not any(each.replaced for each in improved.swaps)
    assert improved.law is None


def test_what_imitated_an_effect_is_dropped_once_the_effect_is_there(rig, sets):
    """Viscous friction stands in for Coulomb's, which comes later and leaves nothing to it."""
    kept = steps_of(rig, sets, "viscous_friction", "constant_force", "coulomb_friction")
    passes = Passes(rig, *sets, {}, silent)
    first, needed, _ = kept.steps
    removal, left = passes.removal(kept, first)
    stays, same = passes.removal(left, needed)

    assert removal.dropped and removal.reasons
    assert left.names == ("constant_force", "coulomb_friction")
    assert not stays.dropped and stays.share_train > 0.5
    assert same is left
    assert left.fit.plant.values["friction.viscous_n_s_m"] == 0.0
    assert per_sample(left.fit) < 1.1 * per_sample(kept.fit)


def test_an_effect_that_another_needs_stays(rig, sets):
    kept = steps_of(rig, sets, "coulomb_friction", "stiction")
    removal, same = Passes(rig, *sets, {}, silent).removal(kept, kept.steps[0])

    assert removal.reasons == ("stiction needs it",)
    assert not removal.dropped and same is kept


def test_a_clearly_better_rival_takes_the_place_and_no_worse_one(rig, sets):
    diagnosis = diagnose(rig, *sets)
    wrong = steps_of(rig, sets, "viscous_friction", "constant_force")
    right = steps_of(rig, sets, "coulomb_friction", "constant_force")
    rounds = {"viscous_friction": diagnosis, "coulomb_friction": diagnosis}
    passes = Passes(rig, *sets, rounds, silent)
    tried, better = passes.swaps(wrong, wrong.steps[0])
    others, same = passes.swaps(right, right.steps[0])

    assert tried[-1].rival.name == "coulomb_friction" and tried[-1].replaced
    assert tried[-1].rival_train > tried[-1].share_train
    assert better.names == ("constant_force", "coulomb_friction")
    assert better.steps[-1].rig.added == better.names
    assert per_sample(better.fit) < 0.5 * per_sample(wrong.fit)
    assert others and not any(each.replaced for each in others)
    assert same is right


def test_an_interrupted_backward_pass_keeps_what_the_rounds_found(rig, sets):
    def progress(message):
        if message.startswith("without "):
            raise KeyboardInterrupt

    found = improve(rig, *sets, progress)

    assert found.stopped
    assert found.kept == tuple(step.candidate.name for step in found.steps)
    assert len(found.rig.added) == len(found.steps) >= 2


def test_free_runs_that_are_interrupted_leave_all_else(rig, sets, monkeypatch):
    def stopped(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(improvement, "free_run_errors", stopped)
    found = improve(rig, *sets)

    assert found.stopped and found.kept and found.after["validation"]
    assert found.free_before == found.free_after == {}


def test_nothing_is_added_where_recording_and_rig_contradict_each_other(sets):
    """The force of another cylinder at a steady pressure: a constant force takes the mean away."""
    time_s = sets[0][0].time_s
    strange = [
        replace(each, channels={**each.channels, "rod.force_n": 400 + 2 * np.sin(2.5 * time_s + k)})
        for k, each in enumerate((*sets[0], *sets[1]))
    ]
    rig = load_rig(f'{BARE}[fixed]\nnames = ["chamber.area"]\n')
    heard = []
    found = improve(rig, strange[:2], strange[2:], heard.append)
    (only,) = found.diagnoses

    assert only.ranking[0].accepted and only.contradicted
    assert found.steps == found.kept == () and found.rig is rig
    assert any("contradict each other" in message for message in heard)
    assert "contradict each other" in improvement_text(found, UNITS)


def test_the_written_rig_gives_the_printed_errors_again(improved, sets, tmp_path):
    write_rig(improved.rig, tmp_path / "rig2.toml")
    again = load_rig(tmp_path / "rig2.toml")

    assert again.plant.values == improved.rig.plant.values
    assert (again.added, again.deviations) == (improved.rig.added, improved.rig.deviations)
    for part, each in (("train", improved.fit), ("validation", improved.validation_fit)):
        known = {n: v for n, v in again.plant.values.items() if n in each.windows.plant.values}
        plant = each.windows.plant.with_values(known)
        point = Point(np.zeros(0), each.point.starts)
        residual = each.windows.residuals([plant], point.starts)[0]
        error = residual * each.windows.scale[:, :, None]
        rmse = np.sqrt(np.nanmean(error**2))
        assert f"{rmse:.4g}" == f"{improved.after[part]['rod.force'].rmse:.4g}"
    before, after = compare(improved.rig, sets[1]), compare(again, sets[1])
    assert after.recordings[0].errors == before.recordings[0].errors


def test_an_improvement_is_told_as_text_and_as_a_document(improved):
    text = improvement_text(improved, UNITS)
    told = json.loads(json.dumps(improvement_document(improved, UNITS), allow_nan=False))

    assert "backward pass" in text and "swap pass" in text
    assert "friction.coulomb_force" in text.split("parameter")[-1]
    assert told["kept"] == list(improved.kept)
    assert [row["effect"] for row in told["removals"]] == list(improved.kept)
    (row,) = [r for r in told["parameters"] if r["name"] == "friction.coulomb_force"]
    assert row["before"] == 0.0 and row["before_std"] is None and row["after_std"] > 0


def test_shares_and_parameters_are_told_alike_as_text_and_as_a_document(improved):
    first, *others = improved.removals
    moved = Moved("rod.mass_kg", 2.0, 2.5, 0.01, 0.2)
    most = {
        key: 1.01 + 0.01 * k
        for k, key in enumerate(
            ("share_train", "share_validation", "rival_train", "rival_validation")
        )
    }
    odd = replace(
        improved,
        removals=(replace(first, share_validation=1.039), *others),
        swaps=(replace(improved.swaps[0], **most),),
        parameters=(moved, replace(moved, after=2.1, deviation=float("nan"))),
    )
    table = improvement_text(odd, UNITS).splitlines()[-2:]
    told = improvement_document(odd, UNITS)

    assert told["removals"][0]["share_validation"] == 1.0
    shares = {value for key, value in told["swaps"][0].items() if "share" in key}
    assert shares == {1.0}
    assert table[0].endswith("2.5 prior deviations away") and table[1].endswith("at its bound")
    assert [row["at_bound"] for row in told["parameters"]] == [False, True]
    assert told["parameters"][0]["prior_deviations_moved"] == pytest.approx(2.5)


def test_what_a_diagnosis_warns_of_is_told_once(improved):
    first, *others = improved.diagnoses
    warned = [replace(each, warned=(Warned("a doubt"),)) for each in (first, first)]
    doubtful = replace(improved, diagnoses=(*warned, *others))

    assert improvement_text(doubtful, UNITS).count("warning: a doubt") == 1
    assert improvement_document(doubtful, UNITS)["warnings"] == ["a doubt"]


def test_the_budget_begins_with_the_rig_as_it_came_then_refitted(improved):
    came, refitted, first, *_ = improved.budget
    told = improvement_document(improved, UNITS)

    assert [each.label for each in (came, refitted)] == ["as it came", "parameters refitted"]
    assert came.train > refitted.train > first.train
    for part in ("train", "validation"):
        rmse = [each[part]["rod.force"].rmse for each in (improved.came, improved.before)]
        assert told["as_it_came"][part]["rod.force"]["rmse"] == rmse[0] != rmse[1]
    ran = replace(improved, free_before=improved.came, free_after=improved.after)
    free = improvement_document(ran, UNITS)["free_run"]
    assert free == {"as_it_came": told["as_it_came"], "after": told["after"]}
    heads = [line.split() for line in improvement_text(improved, UNITS).splitlines()]
    rmse = "RMSE as it came refitted in the end"
    assert any(rmse in " ".join(line) for line in heads)


def test_dropped_and_swapped_steps_are_marked_in_the_budget(improved):
    more = (
        improved.budget[-1]._replace(label="- constant_force", change=Change.DROPPED),
        improved.budget[-1]._replace(label="a for b", change=Change.SWAPPED),
    )
    (axes,) = budget_figure((*improved.budget, *more)).axes
    words = [text.get_text() for text in axes.texts]

    assert {"dropped", "swapped"} <= set(words)
    assert [t.get_text() for t in axes.get_xticklabels()][-1] == "a\nfor b"


def test_a_free_run_of_the_truth_has_no_error_and_of_another_plant_has():
    rig = default_rig("vertical_cylinder")
    pressure_pa = 1.0e5 + 3e5 * (np.arange(300) > 20)
    truth = rig.plant.with_values({"friction.coulomb_force_n": 20.0})
    channels = {"chamber.pressure_pa": pressure_pa}
    kick = simulate(truth.lean(), Recording("kick", 1e-3, channels))
    sets, noise = {"train": [kick]}, {"rod.position_m": 1e-4}
    same = free_run_errors(replace(rig, plant=truth), sets, noise)["train"]["rod.position"]
    other = free_run_errors(rig, sets, noise)["train"]["rod.position"]

    assert same.rmse < 1e-6 < other.rmse
    assert free_run_errors(load_rig(BARE), {"train": [bench(1, nothing)]}, {}) == {}


@pytest.mark.parametrize("names", PAIRS)
def test_a_pair_hides_both_effects_and_no_larger_difference_than_either_case(names):
    pair = stored_pair(*names)
    drive = pair.drive
    for case in (pair.first, pair.second):
        if case.hidden == "supply_droop":
            assert drive.supply_resistance_pa_s_kg == case.size
        else:
            assert {getattr(drive, f) for f in EFFECTS[case.hidden].fields} == {case.size}
    hidden = {f for name in pair.hidden for f in EFFECTS[name].fields}
    alone = type(drive)()
    for case in (pair.first, pair.second):
        for each in case.differences:
            if each.field not in hidden:
                changed = abs(getattr(drive, each.field) - getattr(alone, each.field))
                assert changed <= abs(each.change) * (1 + 1e-9) + 1e-15, each.field


def test_two_effects_of_one_quantity_are_no_pair():
    with pytest.raises(ValueError, match="both set coulomb_n"):
        stored_pair("coulomb_friction", "coulomb_friction", 1)


def test_forms_of_what_was_absent_are_not_far_from_a_belief(rig):
    """A fit begins a wave along the stroke anywhere; nobody believed it to have that phase."""

    def wavy(velocity):
        position = 0.01 * np.cumsum(velocity)
        return coulomb(velocity) * (1.0 + 0.6 * np.sin(2.0 * np.pi * position / 0.05))

    found = improve(rig, [bench(1, wavy)], [bench(2, wavy, gauge_pa=4e5)])
    rows = {row.name: row for row in found.parameters}

    assert "friction_position" in found.kept
    for name in ("friction.wavelength_m", "friction.phase_rad"):
        assert np.isnan(rows[name].far) and not np.isfinite(rows[name].prior_deviation)
    others = [row for name, row in rows.items() if not name.startswith("friction.")]
    assert others and all(np.isfinite(row.far) for row in others)

"""Second thoughts on what was accepted, empirical laws in rig files, and what an improvement says.

The truth of the bench is written in plain numpy, here and in ``test_diagnosis``.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from commands import call
from test_diagnosis import bench, coulomb, nothing

from studies.documents import diagnosis_document
from studies.figures.improvement import budget_figure
from studies.improvement_text import improvement_document, improvement_text
from studies.text_of_results import unit_names
from studies.truth.draw import EFFECTS
from studies.truth.pairs import PAIRS, stored_pair
from workbench.comparison import compare
from workbench.comparison.free_run import free_run_errors
from workbench.comparison.run import run
from workbench.diagnosis.addition import add, add_law, assembled
from workbench.diagnosis.diagnose import diagnose, silent
from workbench.diagnosis.improve import Change, improve
from workbench.diagnosis.passes import Kept, Passes
from workbench.diagnosis.result import Verdict
from workbench.errors import InputError
from workbench.fitting.errors import per_sample
from workbench.fitting.fit import fit
from workbench.fitting.linearised import Point
from workbench.recording import Recording
from workbench.rig import default_rig, load_rig
from workbench.rig_laws import law_terms
from workbench.rig_writing import rig_text, write_rig
from workbench.simulation import simulate

BARE = 'name = "bench"\nplant = "cylinder_bench"\n[values]\n"chamber.area" = "518.7 mm^2"\n'
CURVE_N_M2 = 6e3
CURVED, DRAG = "law[(x - mid)^2]@rod", "law[v|v|]@slide"
UNITS = {"rod.force": "rod.force_n"}
LAW_RIG = f"""name = "drive"
plant = "servo_drive"
[effects]
add = ["{DRAG}"]
[values]
"{DRAG}.quadratic" = "200 N s^2/m^2"
[seen]
"slide.position" = ["30 mm", "250 mm"]
"slide.velocity" = ["-0.3 m/s", "0.3 m/s"]
"""


def curved(seed, gauge_pa=3e5, wider=1.0):
    """The bench with a force that grows with the square of the place, which no catalogue has."""
    found = bench(seed, nothing, gauge_pa=gauge_pa)
    x = wider * found["rod.position_m"]
    channels = {"rod.position_m": x, "rod.force_n": found["rod.force_n"] - CURVE_N_M2 * x**2}
    return replace(found, channels={**found.channels, **channels})


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


@pytest.fixture(scope="module")
def lawful(rig):
    """The bench with the empirical law of the curve, found and taken."""
    return improve(rig, [curved(1), curved(3, 1e5)], [curved(2, 4e5)], law=True)


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


def test_dropped_and_swapped_steps_are_marked_in_the_budget(improved):
    more = (
        improved.budget[-1]._replace(label="- constant_force", change=Change.DROPPED),
        improved.budget[-1]._replace(label="a for b", change=Change.SWAPPED),
    )
    (axes,) = budget_figure((*improved.budget, *more)).axes
    words = [text.get_text() for text in axes.texts]

    assert {"dropped", "swapped"} <= set(words)
    assert [t.get_text() for t in axes.get_xticklabels()][-1] == "a\nfor b"


def test_no_empirical_term_stands_in_a_ranking(lawful):
    for diagnosis in lawful.diagnoses:
        assert not any(row.candidate.name.startswith("law[") for row in diagnosis.ranking)


def test_where_nothing_of_the_catalogue_helps_the_law_is_taken_and_said_to_be_empirical(lawful):
    found, last = lawful.rig, lawful.diagnoses[-1]
    text = rig_text(found)

    assert last.verdict is Verdict.NOT_IN_CATALOGUE
    assert lawful.law is last.law
    assert CURVED in lawful.kept and CURVED in found.added
    assert lawful.budget[-1].change is Change.LAW
    assert lawful.budget[-1].validation < 0.1 * lawful.budget[-2].validation
    assert found.plant.values[f"{CURVED}.curved_n_m2"] == pytest.approx(CURVE_N_M2, rel=0.02)
    assert found.plant.values[f"{CURVED}.middle_m"] == pytest.approx(0.0, abs=1e-4)
    (note,) = [line for line in text.splitlines() if line.startswith(f"# accepted: {CURVED}")]
    assert "empirical, not a physical effect" in note
    assert "rod.position -30 to 30 mm" in note
    assert "empirical" in improvement_text(lawful, UNITS)
    document = diagnosis_document(last, unit_names(found.plant.measured))
    assert document["law"]["add"] == [CURVED] and document["law"]["kind"] == "empirical"


def test_a_law_is_taken_only_where_it_is_asked_for(rig):
    found = improve(rig, [curved(1), curved(3, 1e5)], [curved(2, 4e5)])

    assert found.law is None
    assert not any(name.startswith("law[") for name in found.rig.added)


def test_a_rig_with_a_law_reads_back_as_the_same_model(lawful):
    again = load_rig(rig_text(lawful.rig))

    assert again.plant == lawful.rig.plant
    assert (again.added, again.notes) == (lawful.rig.added, lawful.rig.notes)
    assert (again.seen, again.deviations) == (lawful.rig.seen, lawful.rig.deviations)


def test_leaving_the_range_of_a_law_warns_and_staying_inside_does_not(lawful, recwarn):
    compare(lawful.rig, [curved(2, 2e5)])
    run(lawful.rig, curved(2, 2e5))
    assert not recwarn.list

    with pytest.warns(UserWarning, match=r"rod\.position runs from -45 to 45 mm in bench 2; the "):
        compare(lawful.rig, [curved(2, 2e5, wider=1.5)])
    with pytest.warns(UserWarning, match=r"rod\.position runs from -45 to 45 mm"):
        run(lawful.rig, curved(2, 2e5, wider=1.5))


def test_a_fit_moves_a_law_and_tells_where_it_was_seen_then(lawful):
    found = fit(lawful.rig, [curved(5, 3e5, wider=1.2)])

    assert found.rig.seen["rod.position_m"] == pytest.approx((-0.036, 0.036), abs=1e-4)
    assert f"{CURVED}.curved_n_m2" in [row.name for row in found.rows]


def test_a_law_can_be_added_by_name_and_as_a_whole(rig):
    train, held_out = [curved(1), curved(3, 1e5)], [curved(2, 4e5)]
    one, whole = add(rig, CURVED, train, held_out), add_law(rig, train, held_out)

    assert [step.candidate.name for step in whole] == [CURVED]
    name = f"{CURVED}.curved_n_m2"
    assert one.rig.plant.values[name] == pytest.approx(whole[0].rig.plant.values[name], rel=0.01)
    with pytest.raises(ValueError, match="no empirical law"):
        add_law(rig, [bench(1, nothing)], [bench(2, nothing)])
    with pytest.raises(ValueError, match="has it already"):
        add(one.rig, CURVED, train, held_out)


def test_every_term_of_every_plant_acts_and_is_absent_at_null(plant):
    rng = np.random.default_rng(5)
    for name, term in law_terms(plant).items():
        with_it = plant.with_effects(term)
        (candidate,) = [c for c in with_it.candidates.values() if c.name == name]
        known = with_it.parameters[candidate.strength]
        x = plant.initial + plant.scale * rng.uniform(0.1, 0.5, len(plant.scale))
        u, d, _ = plant.nominal
        d = d + 0.01
        bare, null = plant.model.f(x, u, d, plant.nominal[2]), with_it.model.f
        strong = with_it.with_values({candidate.strength: known.typical})
        for got, same in zip(bare, null(x, u, d, with_it.nominal[2]), strict=True):
            assert np.array_equal(np.array(got), np.array(same)), name
        changed = [
            np.abs(np.array(a) - np.array(b)).max(initial=0.0)
            for a, b in zip(bare, null(x, u, d, strong.nominal[2]), strict=True)
        ]
        assert max(changed) > 0.0, name


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (f'add = ["{DRAG}"]', 'add = ["law[v|v]@slide"]', "did you mean 'law[v|v|]@slide'"),
        ('["30 mm", "250 mm"]', '["30 mm"]', "is no range; expected a list of two"),
        ('["30 mm", "250 mm"]', '["300 mm", "250 mm"]', "begins above its end"),
        ('["30 mm", "250 mm"]', '["30 V", "250 mm"]', "unit 'V' does not fit"),
        ('"slide.velocity" =', '"slide.velocit" =', "did you mean 'slide.velocity'"),
        (f'add = ["{DRAG}"]\n[values]\n"{DRAG}.quadratic" = "200 N s^2/m^2"', "",
         "is the range of an empirical law, and [effects] adds none"),
    ],
)  # fmt: skip
def test_a_law_that_is_mistyped_is_refused_with_its_place(old, new, said):
    with pytest.raises(InputError) as refused:
        load_rig(LAW_RIG.replace(old, new))

    assert said in str(refused.value)


def test_the_command_names_the_terms_there_are(tmp_path):
    (tmp_path / "rig.toml").write_text(LAW_RIG)
    rows = "\n".join(f"{1e-3 * k:.3f},4.95" for k in range(400))
    (tmp_path / "train.csv").write_text(f"time,valve.command\ns,V\n{rows}\n")
    words = ("--fit", tmp_path / "train.csv", "-o", tmp_path / "rig2.toml")
    answer = call("add", tmp_path / "rig.toml", "law[v^2]@slide", *words)

    assert answer.exit_code == 2
    assert "law[v^3]@slide" in answer.stderr
    assert "law[v|v|]@slide" in call("add", "--help").output
    assert "--law" in call("improve", "--help").output


def test_a_rig_with_a_law_simulates_and_has_modes(tmp_path):
    (tmp_path / "rig.toml").write_text(LAW_RIG)
    rows = "\n".join(f"{1e-3 * k:.3f},{6.5 if k > 20 else 4.95}" for k in range(400))
    (tmp_path / "commands.csv").write_text(f"time,valve.command\ns,V\n{rows}\n")
    out = tmp_path / "simulated.csv"
    answer = call("simulate", tmp_path / "rig.toml", tmp_path / "commands.csv", "-o", out)
    modes = call("modes", tmp_path / "rig.toml", "--json", tmp_path / "modes.json")

    assert answer.exit_code == 0, answer.output
    assert "slide.velocity runs from" in answer.stderr
    assert modes.exit_code == 0, modes.output
    free = default_rig("servo_drive").plant
    lean, dragged = (p.lean() for p in (free, load_rig(LAW_RIG).plant))
    recording = Recording("up", 1e-3, {"valve.command_v": np.full(400, 6.5)})
    speeds = [simulate(each, recording)["slide.velocity_m_s"].max() for each in (lean, dragged)]
    assert speeds[1] < speeds[0]


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

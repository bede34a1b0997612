"""Empirical laws as effects of a rig file: found, taken, written, read, and left behind.

The truth of the bench is written in plain numpy, here and in ``test_diagnosis``.
"""

from dataclasses import replace

import numpy as np
import pytest
from commands import call
from test_diagnosis import AMBIENT_PA, bench, nothing

from controllers.design_file import design, read_design, write_design
from studies.documents import diagnosis_document
from studies.improvement_text import improvement_text
from studies.text_of_results import unit_names
from workbench.comparison import compare
from workbench.comparison.run import simulate as run
from workbench.diagnosis.addition import add
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.improve import improve
from workbench.diagnosis.improvement import Change
from workbench.diagnosis.law_addition import add_law
from workbench.diagnosis.result import Verdict
from workbench.errors import InputError
from workbench.fitting.fit import fit
from workbench.parts import Atmosphere, Supply
from workbench.plant import Plant
from workbench.plants import closed_chamber
from workbench.reading.writer import write_recording
from workbench.recording import Recording
from workbench.rig import default_rig, load_rig
from workbench.rig_laws import law_terms
from workbench.rig_writing import rig_text
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


def wavy(recording):
    """Another force beside, a sine of the place."""
    force_n = 5.0 * np.sin(2 * np.pi * recording["rod.position_m"] / 0.06)
    channels = {**recording.channels, "rod.force_n": recording["rod.force_n"] - force_n}
    return replace(recording, channels=channels)


@pytest.fixture(scope="module")
def rig():
    return load_rig(BARE)


@pytest.fixture(scope="module")
def lawful(rig):
    """The bench with the empirical law of the curve, found and taken."""
    return improve(rig, [curved(1), curved(3, 1e5)], [curved(2, 4e5)], law=True)


def test_no_empirical_term_stands_in_a_ranking_also_where_the_rig_has_one(lawful):
    again = diagnose(lawful.rig, [curved(1), curved(3, 1e5)], [curved(2, 4e5)])

    assert again.verdict is Verdict.NOTHING_MISSING
    for diagnosis in (*lawful.diagnoses, again):
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


def test_what_a_law_leaves_nothing_to_goes_when_it_comes(rig):
    """A force that had stood for the curve stayed in the rig file with 0.04 mN of its 2.5 N."""
    sets = [wavy(curved(1)), wavy(curved(3, 1e5))], [wavy(curved(2, 4e5))]
    found = improve(rig, *sets, law=True)

    assert found.steps[0].candidate.name == "constant_force"
    assert {*found.kept} == {*found.rig.added} == {"law[sin(2 pi x/L)]@rod", CURVED}
    (gone,) = [each for each in found.removals if each.dropped]
    assert gone.candidate.name == "constant_force" and "beside the law" in gone.reasons[0]
    assert found.budget[-1].validation < 0.01 * found.budget[0].validation
    text = improvement_text(found, UNITS)
    assert "dropped: beside the law its size is negligible" in text


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


def test_a_fit_that_leaves_a_law_as_it_is_leaves_its_range_too(lawful):
    narrow = curved(5, 3e5, wider=0.5)
    alone = fit(lawful.rig, [narrow], only=("atmosphere.pressure_pa",))
    both = fit(lawful.rig, [narrow])

    assert alone.rig.seen == lawful.rig.seen
    assert both.rig.seen["rod.position_m"] == pytest.approx((-0.015, 0.015), abs=1e-4)


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
    with pytest.raises(ValueError, match="added one at a time, or all as `law`"):
        add(rig, f"{CURVED} + law[1]@rod", train, held_out)


def test_every_term_of_every_plant_acts_and_is_absent_at_null(plant):
    terms = law_terms(plant)
    lawful = plant.with_effects(*terms.values())
    x = plant.initial + plant.scale * np.random.default_rng(5).uniform(0.1, 0.5, len(plant.scale))
    u, d, p = plant.nominal
    u = u + 1.0  # a command of its nominal value is none, nor one in a dead zone

    def rates_and_outputs(values):
        with_them = lawful.with_values(values).nominal[2]
        return np.vstack([part.full() for part in lawful.model.f(x, u, d + 0.01, with_them)])

    at_null = rates_and_outputs({})
    bare = [part.full() for part in plant.model.f(x, u, d + 0.01, p)]
    assert np.array_equal(at_null, np.vstack(bare))
    for name in terms:
        strength = lawful.candidates[name].strength
        typical = lawful.parameters[strength].typical
        assert not np.array_equal(rates_and_outputs({strength: typical}), at_null), name


def test_a_term_over_the_supply_reads_it_by_its_own_name():
    plant = closed_chamber()
    name = "law[p/p_s]@chamber"
    fed = replace(plant, parts=(*plant.parts, Supply(name="bottle")))
    lawful = fed.with_effects(law_terms(fed)[name]).with_values({f"{name}.pressure_kg_s": 1e-4})
    u, d, p = lawful.nominal

    assert name not in law_terms(plant)
    assert lawful.model.f(lawful.initial, u, d, p)[0].full().any()


def test_a_term_over_the_atmosphere_reads_it_by_its_own_name():
    chamber = next(part for part in closed_chamber().parts if part.name == "chamber")
    parts = (Atmosphere(name="room"), replace(chamber, initial_pressure_pa=5e5))
    own = Plant(name="own", parts=parts, measured=("chamber.pressure_pa",))
    name = "law[p]@chamber"
    lawful = own.with_effects(law_terms(own)[name]).with_values({f"{name}.size_kg_s": 1e-4})
    u, d, p = lawful.nominal

    assert lawful.model.f(lawful.initial, u, d, p)[0].full().any()
    assert name not in law_terms(replace(own, parts=own.parts[1:]))


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
    answer = call("add", tmp_path / "rig.toml", "law[v^4]@slide", *words)

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


def test_a_design_on_a_plant_with_a_law_reads_back_with_it(tmp_path):
    plant = load_rig(LAW_RIG).plant
    write_design(design("pid", plant), tmp_path / "pid.toml")

    assert read_design(tmp_path / "pid.toml").plant == plant


def test_the_command_takes_a_whole_law_from_recordings(tmp_path):
    (tmp_path / "rig.toml").write_text(BARE)
    for seed, name in ((1, "train"), (2, "validation")):
        recording = replace(curved(seed), noise={})
        write_recording(recording, tmp_path / f"{name}.csv", ambient_pa=AMBIENT_PA)
    train, held_out, out = (tmp_path / n for n in ("train.csv", "validation.csv", "rig2.toml"))
    words = ("--fit", train, "--validate", held_out, "-o", out)
    answer = call("add", tmp_path / "rig.toml", "law", *words, "-q")

    assert answer.exit_code == 0, answer.output
    assert f"{CURVED}: empirical, not a physical effect" in answer.stdout
    assert load_rig(out).plant.values[f"{CURVED}.curved_n_m2"] == pytest.approx(6e3, rel=0.05)

"""The report of an improvement: its page, and the next recording that its end asks for."""

# ruff: noqa: F811  (fixtures of other tests)

import json
from dataclasses import replace

import pytest
from test_improvement import UNITS, improved, rig, sets  # noqa: F401
from test_next_recording import asked, demo_rig, rivals  # noqa: F401

from studies.export import save_commands
from studies.improvement_text import endings, improvement_document, improvement_text
from studies.report.improvement import _next_recording, report_improvement
from workbench.candidate import TOGETHER
from workbench.diagnosis.improvement import Change, Stage
from workbench.diagnosis.judge import HELD_OUT_REASON, SHARE_REASON
from workbench.diagnosis.passes import Removal, Swap


def test_the_report_of_an_improvement_has_each_diagnosis_and_addition(improved, tmp_path):
    page = report_improvement(improved, tmp_path, "a command").read_text()

    for number, diagnosis in enumerate(improved.diagnoses, start=1):
        assert f"Diagnosis {number}" in page and diagnosis.sentence in page
    for step in improved.steps:
        assert step.candidate.name in page
    assert (tmp_path / "figures" / "error_by_effect.svg").is_file()
    assert not (tmp_path / "figures" / "next_recording.csv").exists()  # a bench has no commands


@pytest.mark.filterwarnings("ignore:.*did you mean 'reference")
def test_what_the_last_diagnosis_leaves_open_comes_with_commands(
    improved,
    demo_rig,
    asked,
    tmp_path,
):
    open_end = replace(improved.diagnoses[-1], next_recording=asked)
    found = replace(improved, rig=demo_rig, diagnoses=(*improved.diagnoses, open_end))

    (section,) = _next_recording(found, tmp_path, "a command")

    assert asked.what in section.table and section.figures == ("next_recording",)
    assert (tmp_path / "figures" / "next_recording.csv").read_text().startswith("time_s,command_V")
    assert (tmp_path / "figures" / "next_recording.svg").is_file()
    assert section.text == ("figures/next_recording.csv holds the reference of the loop below",)

    alone = replace(open_end, next_recording=replace(asked, conduct=None))
    (section,) = _next_recording(replace(found, diagnoses=(alone,)), tmp_path, "a command")
    assert section.text == ("figures/next_recording.csv holds the commands, ready to play",)


def test_commands_come_with_how_to_play_them_under_their_own_name(demo_rig, asked, tmp_path):
    save_commands(demo_rig, asked, tmp_path / "tonight.csv")

    assert (tmp_path / "tonight.csv").read_text().startswith("time_s,command_V")
    assert "speed of slide.position" in (tmp_path / "tonight_how.txt").read_text()


def test_the_document_of_an_improvement_holds_its_last_diagnosis(improved):
    told = json.loads(json.dumps(improvement_document(improved, UNITS), allow_nan=False))

    last = told["last_diagnosis"]
    assert last["schema"] == "workbench.diagnosis/1"
    assert last["verdict"] == improved.diagnoses[-1].verdict.value
    assert last["sentence"] == told["diagnoses"][-1]
    assert last["contradicted"] is False


def test_a_shift_of_what_is_there_is_told_as_another_value_and_not_as_added(improved):
    """`+ stiction added` was told where there is less of it than the rig says."""
    label = f"+ {improved.steps[0].candidate.name}"
    shifted = replace(
        improved,
        budget=tuple(
            bar._replace(change=Change.SHIFTED) if bar.label == label else bar
            for bar in improved.budget
        ),
    )

    def told(found):
        return next(x for x in improvement_text(found, UNITS).splitlines() if f"{label} " in x)

    assert "another value" in told(shifted) and "added" not in told(shifted)
    assert "added" in told(improved)
    changes = [bar["change"] for bar in improvement_document(shifted, UNITS)["budget"]]
    assert changes[2] == "another value" and "added" in changes


def budget_of(*bars):
    """A budget of bars, each with its label, its errors on both sets, and its change."""
    begun = Stage("parameters refitted", 7313.0, 600.0, Change.REFITTED)
    return (begun, *(Stage(*bar) for bar in bars))


def test_a_bar_that_rises_where_the_verdict_falls_is_told_with_the_weights_of_both(improved):
    first, second = improved.steps
    names = [step.candidate.name for step in improved.steps]
    steps = tuple(replace(step, drop_train=0.7, drop_validation=0.6) for step in (first, second))
    added, better = f"+ {names[0]}", (f"+ {names[1]}", 31.9, 98.96)
    found = replace(improved, steps=steps, budget=budget_of((added, 3192.0, 989.56), better))
    (said,) = endings(found)

    assert said == (
        f"{added}: weighed by sensor noise alone, validation rises from 600 to 989.6; the verdict "
        "also weighs by what the model cannot follow, no window counting too much"
    )
    assert said in improvement_text(found, UNITS).splitlines()
    assert improvement_document(found, UNITS)["endings"] == [said]
    unmoved = replace(found, budget=budget_of((added, 3192.0, 600.0001), better))
    assert endings(unmoved) == []
    worse = (replace(first, drop_train=-0.1, drop_validation=-0.1), second)
    (said,) = endings(replace(found, steps=worse))
    assert "alone, training falls from 7313 to 3192; the" in said


def test_a_pair_and_a_swap_have_the_verdict_of_their_own(improved):
    first, second = improved.steps
    one, other = first.candidate, second.candidate
    steps = tuple(replace(step, drop_train=0.7, drop_validation=0.6) for step in (first, second))
    pair = budget_of((f"+ {TOGETHER.join((one.name, other.name))}", 8000.0, 900.0))
    (said,) = endings(replace(improved, steps=steps, budget=pair))
    assert "training rises from 7313 to 8000 and validation rises from 600 to 900" in said

    swap = Swap(one, other, 0.5, 0.5, 0.6, 0.7, replaced=True)
    bars = budget_of((f"{other.name} for {one.name}", 7000.0, 700.0, Change.SWAPPED))
    (said,) = endings(replace(improved, swaps=(swap,), budget=bars))
    assert "validation rises from 600 to 700" in said and "training" not in said


@pytest.mark.parametrize(
    ("came", "said"),
    [
        ({"replaced": True}, "takes its place"),
        ({"leaves_more": True}, "both errors would grow"),
        ({}, "not clearly better"),
    ],
)
def test_a_rival_is_told_with_what_came_of_it(improved, came, said):
    swap = replace(improved.swaps[0], **{"replaced": False, "leaves_more": False, **came})
    text = improvement_text(replace(improved, swaps=(swap,)), UNITS)
    (line,) = [line for line in text.splitlines() if f"or {swap.rival.name}" in line]

    assert line.endswith(said)


def test_an_effect_that_is_dropped_although_bars_rise_is_told(improved):
    candidate = improved.steps[0].candidate
    worse = Removal(candidate, 0.08, 0.05, reasons=(HELD_OUT_REASON,), dropped=True)
    bars = budget_of((f"- {candidate.name}", 7000.0, 900.0, Change.DROPPED))
    found = replace(improved, removals=(worse,), budget=bars)
    (said,) = endings(found)
    assert said.startswith(f"- {candidate.name}: ")
    assert "validation rises from 600 to 900" in said and "training falls from 7313" in said

    small = replace(worse, reasons=(SHARE_REASON,))
    rises = budget_of((f"- {candidate.name}", 8000.0, 900.0, Change.DROPPED))
    assert endings(replace(found, removals=(small,), budget=rises)) == []

"""What an improvement ends with: the rig file, and what is said of it, are the same model."""

# ruff: noqa: F811  (fixtures of other tests)

from dataclasses import replace
from math import inf, nan
from types import SimpleNamespace

import pytest
from test_diagnosis import bench, nothing
from test_improvement import UNITS, improved, rig, sets, steps_of  # noqa: F401
from test_laws_in_rigs import curved
from test_report import LEAK, diagnosis, ranked

from studies.improvement_text import STOPPED, improvement_document, improvement_text
from studies.report.improvement import report_improvement
from workbench.comparison import compare
from workbench.diagnosis import improve as improving
from workbench.diagnosis import rounds
from workbench.diagnosis.addition import assembled
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.improve import _counted_from, improve
from workbench.diagnosis.improvement import Change, Stage
from workbench.diagnosis.rounds import Rounds
from workbench.diagnosis.verdict import not_converged, worsened
from workbench.diagnosis.warned import Of, Warned
from workbench.effect import Kind
from workbench.fitting.errors import SignalError, errors_of, per_sample
from workbench.fitting.posterior import Moved
from workbench.rig import default_rig, load_rig

OFF = """name = "bench"
plant = "cylinder_bench"
[values]
"chamber.area" = "500 mm^2"
[uncertainty]
"chamber.area" = "20 mm^2"
"""
BLANK = [bench(1, nothing), bench(3, nothing, 0.0, 1e5)], [bench(2, nothing, 0.0, 4e5)]


def test_where_nothing_is_added_the_errors_are_those_of_the_rig_that_is_written():
    """A bore 3.6 % off: a refit takes that away, but is not what the file holds."""
    off = load_rig(OFF)
    found = improve(off, *BLANK)
    (compared,) = compare(found.rig, BLANK[1]).recordings
    (errors,) = compared.errors.values()
    told = improvement_document(found, UNITS)
    text = improvement_text(found, UNITS)

    assert found.rig is off and found.kept == ()
    assert found.before["validation"]["rod.force"].rmse < 0.25
    assert found.after == found.came and told["after"] == told["as_it_came"]
    left = found.after["validation"]["rod.force"].rmse
    assert left == pytest.approx(errors["rod.force_n"].rmse, rel=0.1)
    assert "the rig file is as it came" in text and told["endings"][0] in text


def test_a_form_is_told_from_where_the_rig_has_it_not_from_where_the_last_fit_began(rig):
    wavelength = Moved("friction.wavelength_m", 0.09684, 0.05, 1e-3, 0.01)
    told = _counted_from(rig, [wavelength.name], wavelength)

    assert told.before == rig.plant.values[wavelength.name] == 0.08
    assert told.after == 0.05 and told.prior_deviation == inf


DELAY = Moved("command_delay.delay_s", 0.0, 2.7e-3, 1e-4, 2e-3)


def test_what_every_fit_may_use_a_little_of_keeps_its_prior():
    drive = default_rig("servo_drive")
    late = replace(drive, plant=drive.plant.with_values({DELAY.name: 5e-3}))

    assert _counted_from(drive, (), DELAY) == DELAY
    assert _counted_from(late, (), DELAY).before == 5e-3
    assert _counted_from(drive, (), replace(DELAY, prior_deviation=inf)).prior_deviation == inf


@pytest.mark.parametrize(
    ("moved", "told"),
    [({}, True), ({"after": 3e-3, "deviation": nan}, True), ({"after": 0.5e-3}, False),
     ({"deviation": 2e-3}, False), ({"prior_deviation": inf}, False), ({"before": 1e-3}, False)],
)  # fmt: skip
def test_a_delay_that_comes_in_without_being_named_is_said(improved, moved, told):
    drive = default_rig("servo_drive")
    found = replace(improved, rig=drive, parameters=(replace(DELAY, **moved),))
    said = "the rig file also takes command_delay.delay = "

    assert (said in improvement_text(found, UNITS)) is told
    endings = improvement_document(found, UNITS)["endings"]
    assert any(each.startswith(said) for each in endings) is told


def test_what_was_said_of_an_earlier_model_stands_with_its_diagnosis_and_not_at_the_end(improved):
    """What is said of the recordings stays: it is true of every model of them."""
    small, large = ({"train": {"rod.force": SignalError(rmse, 0.0, 1.0)}} for rmse in (1.0, 9.0))
    of_the_model = (
        *worsened(small, large),
        Warned("rod.mass would go further than the rig believes", Of.MODEL),
        not_converged("the prior fit", "the ranking is provisional"),
    )
    left, doubt = "rod.force 9 times its noise remains", "rod.force is saturated"
    first, *others, last = improved.diagnoses
    warned = (*of_the_model, Warned(left, Of.ERRORS_LEFT), Warned(doubt))
    warned = replace(first, warned=warned)
    found = replace(improved, diagnoses=(warned, *others, last))
    lines = improvement_text(found, UNITS).splitlines()

    assert found.warnings == (doubt, *last.warnings)
    assert lines.count(f"warning: {doubt}") == 1 and not any(left in line for line in lines)
    begun = next(k for k, line in enumerate(lines) if line.startswith("diagnosis 1: "))
    then = [f"  it warned then: {warning.text}" for warning in of_the_model]
    assert lines[begun + 1 : begun + 1 + len(then)] == then
    at_the_end = replace(found, diagnoses=(first, *others, warned))
    assert at_the_end.warnings == warned.warnings


def test_the_last_bar_and_the_errors_in_the_end_are_of_the_same_fit(rig, sets, monkeypatch):
    """Also where the last diagnosis accepts something that a contradiction keeps out."""
    kept = steps_of(rig, sets, "coulomb_friction", "constant_force")
    last = diagnose(assembled(rig, kept.steps), *sets)
    first = diagnose(rig, *sets)
    worse = replace(kept, fit=first.base, validation=first.base_validation)
    done = Rounds(rig, kept=worse, steps=kept.steps).told(first)
    done = done.marked("+ both", worse.fit, worse.validation, Change.ADDED)
    refused = replace(last, ranking=(replace(first.ranking[0], accepted=True),), contradicted=True)
    monkeypatch.setattr(
        improving, "forward", lambda *asked: done.told(refused).fitted_again(refused)
    )
    monkeypatch.setattr(improving, "_thought_over", lambda done, *asked: done)
    found = improve(rig, *sets)

    assert found.budget[-1].train == per_sample(last.base) < 0.5 * per_sample(worse.fit)
    assert found.fit is last.base and found.validation_fit is last.base_validation
    assert found.after == errors_of(last.base, last.base_validation)
    assert "a row is as low as the next diagnosis fits" in improvement_text(found, UNITS)


def test_a_fit_of_the_model_before_a_step_is_not_taken_for_that_of_the_end(rig, sets):
    kept = steps_of(rig, sets, "coulomb_friction", "constant_force")
    first = diagnose(rig, *sets)
    done = Rounds(rig, kept=kept).told(first)
    lower = replace(done, again=(first.base, first.base_validation))

    assert lower.last_fit == (first.base, first.base_validation)
    later = lower.marked("- it", kept.fit, kept.validation, Change.DROPPED)
    assert later.last_fit == (kept.fit, kept.validation)


def dropped_to(done, kept, monkeypatch):
    """Improvements of which rounds and second thoughts are given: what they leave."""
    monkeypatch.setattr(improving, "forward", lambda *asked: done)
    monkeypatch.setattr(improving, "_thought_over", lambda done, *asked: replace(done, kept=kept))


def test_an_effect_that_is_missing_after_the_second_thoughts_bars_a_law_and_is_told(
    rig, sets, monkeypatch
):
    """Viscous friction and the force came in, and the former went: Coulomb's is missing."""
    began, force = (
        steps_of(rig, sets, *names)
        for names in (("viscous_friction", "constant_force"), ("constant_force",))
    )
    done = Rounds(rig, kept=began, steps=began.steps).told(diagnose(rig, *sets))
    dropped_to(done.marked("- viscous", force.fit, force.validation, Change.DROPPED), force,
               monkeypatch)  # fmt: skip
    found = improve(rig, *sets, law=True)
    text = improvement_text(found, UNITS)

    assert len(found.diagnoses) == 2 and found.diagnoses[-1].ranking[0].accepted
    assert found.law is None and found.left_out == "coulomb_friction"
    assert "coulomb_friction passes every criterion on top of what is kept" in text
    assert f"diagnosis 2: {found.diagnoses[-1].sentence}" in text
    assert found.rig.added == ("constant_force",)
    assert found.budget[-1].train == per_sample(found.fit)


@pytest.mark.parametrize(
    ("kind", "law", "first"),
    [(Kind.EFFECT, True, True), (Kind.PARAMETER, True, False), (Kind.PARAMETER, False, True)],
)
def test_a_shift_does_not_come_in_where_a_law_explains_more(kind, law, first):
    """The friction of a drive had gone 56 deviations off to stand for a drag that a law tells."""
    row = replace(ranked(LEAK, 0.5, accepted=True), kind=kind, fit="its fit")
    found = replace(diagnosis(), ranking=(row,), law="a law" if law else None)

    assert rounds.accepts(found)
    assert rounds.comes_first(found) is first


def test_a_law_that_was_taken_is_not_offered(rig):
    lawful = improve(rig, [curved(1), curved(3, 1e5)], [curved(2, 4e5)], law=True)
    text = improvement_text(lawful, UNITS)

    assert lawful.law and "law (empirical, not a physical effect)" in text
    assert "takes it" not in text


def test_an_interrupt_and_rounds_that_are_used_up_are_told(rig, sets, monkeypatch):
    def interrupted(message):
        if message.startswith("round 2"):
            raise KeyboardInterrupt

    stopped = improve(rig, *sets, interrupted)
    assert improvement_text(stopped, UNITS).splitlines()[-1].startswith("stopped by the user")
    assert improvement_document(stopped, UNITS)["endings"] == [STOPPED]

    monkeypatch.setattr(rounds, "MOST_ROUNDS", 1)
    ended = improve(rig, *sets)
    assert ended.used_up and not ended.stopped
    assert improvement_text(ended, UNITS).splitlines()[-1].startswith("no round was left")


def test_an_improvement_that_came_to_its_end_has_nothing_more_to_say(improved):
    assert not improved.used_up and not improved.left_out
    assert improvement_document(improved, UNITS)["endings"] == []


def test_the_report_marks_what_went_again_and_shows_the_rival_that_took_a_place(improved, tmp_path):
    friction, force = improved.steps
    drop, swap = improved.removals[0], improved.swaps[0]
    rival = swap.rival
    changed = replace(
        improved,
        removals=(replace(drop, candidate=friction.candidate, dropped=True),),
        swaps=(
            replace(swap, candidate=force.candidate, rival=rival, replaced=True, addition=force),
        ),
    )
    page = report_improvement(changed, tmp_path / "changed", "a command").read_text()
    plain = report_improvement(improved, tmp_path / "plain", "a command").read_text()

    assert f"Addition 1: {friction.candidate.name}, dropped later" in page
    assert f"Addition 2: {force.candidate.name}, later replaced by {rival.name}" in page
    assert f"Swapped in: {rival.name} for {force.candidate.name}" in page
    assert not any(word in plain for word in ("dropped later", "later replaced", "Swapped in"))


def test_errors_over_windows_of_another_length_are_not_compared(improved, rig):
    last = improved.diagnoses[-1]
    stage = Stage("+ it", 2.0 * per_sample(last.base), 2.0 * per_sample(last.base_validation))
    same = last.base.windows.length
    lowered = [
        Rounds(rig, kept=kept_over(length), budget=(stage,)).fitted_again(last)
        for length in (same, same // 2)
    ]

    assert lowered[0].again and lowered[0].budget != (stage,)
    assert lowered[1].again is None and lowered[1].budget == (stage,)


def kept_over(length):
    """What is kept, as far as the length of its windows."""
    return SimpleNamespace(fit=SimpleNamespace(windows=SimpleNamespace(length=length)))

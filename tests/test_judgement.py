"""What a diagnosis believes: criteria, ties, shifts at a bound, windows and their error model."""

from dataclasses import replace

import numpy as np
import pytest
from test_diagnosis import bench, coulomb

from studies.text_of_results import moved_text
from workbench.comparison.regimes import regimes
from workbench.diagnosis.diagnose import diagnose, silent
from workbench.diagnosis.follow import follow
from workbench.diagnosis.improve import add, improve
from workbench.diagnosis.judge import SHARE_REASON, reasons_against
from workbench.diagnosis.ranking import ranked
from workbench.diagnosis.result import DecidedBy, Size, Verdict
from workbench.diagnosis.shifts import shifts
from workbench.fitting.error_model import error_model
from workbench.fitting.fit import fit
from workbench.fitting.posterior import moved_parameters
from workbench.fitting.problem import pose, split, training_drop
from workbench.fitting.window_length import window_length_s
from workbench.plants.servo_drive import servo_drive
from workbench.recording import Recording
from workbench.rig import default_rig, load_rig
from workbench.rig_writing import rig_text

BARE = 'name = "bench"\nplant = "cylinder_bench"\n[values]\n"chamber.area" = "518.7 mm^2"\n'
TRAIN, HELD_OUT = bench(1, coulomb), bench(2, coulomb, gauge_pa=4e5)


@pytest.fixture(scope="module")
def problem():
    return pose(load_rig(BARE), [TRAIN], [HELD_OUT])


@pytest.fixture(scope="module")
def followed(problem):
    return follow(problem, None, silent)


@pytest.fixture(scope="module")
def sound(problem, followed):
    """A refit that passes every criterion."""
    (found,) = [r for r in followed.refits if r.candidate.name == "coulomb_friction"]
    assert not reasons_against(problem.base, found)
    return found


def unsure(refit):
    """The same with a size of one deviation."""
    return replace(
        refit, size={k: Size(s.value, np.nan, abs(s.value)) for k, s in refit.size.items()}
    )


def named(refit, followed, k):
    """The same under the name of another candidate."""
    others = [p.candidate for p in followed.profiles if p.candidate != refit.candidate]
    cause = replace(refit.candidate.cause, name=others[k].cause.name)
    return replace(refit, candidate=replace(refit.candidate, cause=cause))


def test_the_share_that_counts_is_the_share_that_is_printed(problem, sound):
    weak = replace(sound, drop_train=0.11, drop_validation=0.03, plain_validation=0.5)

    assert SHARE_REASON in reasons_against(problem.base, weak)


def test_a_size_of_one_deviation_is_not_accepted(problem, sound):
    assert reasons_against(problem.base, unsure(sound)) == ("its size is not distinct from none",)


def test_a_size_at_the_whole_of_itself_has_no_deviation_and_is_not_refused_for_that(problem, sound):
    """So a lag of a sensor ends that is all there: its typical size is its bound."""
    whole = {name: Size(size.value, np.nan, np.nan) for name, size in sound.size.items()}

    assert reasons_against(problem.base, replace(sound, size=whole)) == ()


def test_an_accepted_row_leads_one_that_fails_a_criterion(problem, followed, sound):
    """Though that one takes twice as much of the error, the verdict is not "nothing missing"."""
    larger = replace(unsure(named(sound, followed, 0)), drop_train=0.99)
    smaller = replace(sound, drop_train=0.45)
    both = sorted([larger, smaller], key=lambda r: bool(reasons_against(problem.base, r)))

    rows = ranked(problem, followed.profiles, both, [], {})

    assert rows[0].accepted
    assert rows[0].candidate == sound.candidate


def test_a_row_that_was_left_behind_says_at_which_stage(problem, followed):
    one, other = (p.candidate.name for p in followed.profiles[:2])
    rows = ranked(problem, followed.profiles, [], [], {one: 0.05, other: -0.2})
    reasons = {row.candidate.name: row.reasons for row in rows}

    assert "after a first fit, which removed 5%" in reasons[one][0]
    assert "no first fit with it came as low as the prior fit" in reasons[other][0]
    assert all(r.reasons != ("not among the best of the scan",) for r in rows if r.drop_train <= 0)


def test_what_an_earlier_base_led_to_stays_where_it_is_lower(problem, followed, sound):
    """And counts from the base there is now; a refit that ended higher there is forgotten."""
    cost = 0.9 * sound.fit.cost
    lower = replace(sound, fit=replace(sound.fit, cost=cost), drop_train=0.01)
    other = next(r for r in followed.refits if r.candidate != sound.candidate)
    higher = replace(other, fit=replace(other.fit, cost=1.1 * other.fit.cost))

    again = follow(problem, None, silent, [lower, higher])
    found = {r.candidate.name: r for r in again.refits}

    assert found["coulomb_friction"].fit.cost == cost
    drop = training_drop(problem.base, lower.fit)
    assert drop > 0.9
    assert found["coulomb_friction"].drop_train == pytest.approx(drop)
    assert found[other.candidate.name].fit.cost < higher.fit.cost


def test_errors_far_above_the_noise_are_spoken_of_where_nothing_is_named():
    """A force that no effect of the bench can give, 50 times the sensor's noise."""
    t = TRAIN.time_s

    def pushed(recording):
        force = recording["rod.force_n"] + 10.0 * np.sign(np.sin(37.0 * t))
        return replace(recording, channels={**recording.channels, "rod.force_n": force})

    none = bench(1, lambda v: 0.0 * v), bench(2, lambda v: 0.0 * v)
    found = diagnose(load_rig(BARE), [pushed(none[0])], [pushed(none[1])])

    assert found.verdict is Verdict.NOTHING_MISSING
    assert found.after == {}
    assert any("rod.force" in w and "times its noise" in w for w in found.warnings)


def test_a_parameter_at_its_bound_is_no_shift():
    """The recording would want negative friction: freeing a prior brings nothing there."""
    text = (
        f'{BARE}"friction.coulomb_force" = "4 N"\n[uncertainty]\n"friction.coulomb_force" = "2 N"\n'
    )
    helped = bench(1, lambda v: -0.3 * coulomb(v))
    found = pose(load_rig(text), [helped])

    assert found.base.plant.values["friction.coulomb_force_n"] == 0.0
    assert "friction.coulomb_force_n" not in [shift.name for shift in shifts(found)]
    (row,) = [r for r in moved_parameters(found.base) if r.name == "friction.coulomb_force_n"]
    assert np.isnan(row.deviation) and moved_text([row]).endswith("0 N  at its bound")


def test_improve_writes_a_note_for_every_effect_it_added():
    def both(v):
        return coulomb(v) + 5.0

    found = improve(
        load_rig(BARE), [bench(1, both), bench(3, both, 0.0, 1e5)], [bench(2, both, 0.0, 4e5)]
    )

    assert len(found.steps) >= 2
    assert len(found.rig.notes) == len(found.steps)
    for step, note in zip(found.steps, found.rig.notes, strict=True):
        assert note.startswith(f"{step.candidate.name}: ")


def test_add_refuses_what_the_rig_fixes_and_what_changes_nothing():
    fixed = f'{BARE}[fixed]\nnames = ["friction.coulomb_force"]\n'

    with pytest.raises(ValueError, match=r"bench fixes friction\.coulomb_force:"):
        add(load_rig(fixed), "coulomb_friction", [TRAIN], [HELD_OUT])
    with pytest.raises(ValueError, match=r"nothing without friction\.coulomb_force$"):
        add(load_rig(BARE), "stiction", [TRAIN], [HELD_OUT])


def test_what_the_rig_removes_can_be_added_again_and_is_written():
    rig = load_rig(f'{BARE}[effects]\nremove = ["coulomb_friction"]\n')
    found = add(rig, "coulomb_friction", [TRAIN], [HELD_OUT]).rig
    again = load_rig(rig_text(found))

    assert (again.added, again.removed) == (("coulomb_friction",), ())
    assert again.plant.values["friction.coulomb_force_n"] == pytest.approx(8.0, rel=0.05)
    assert again.plant.values == found.plant.values


def test_what_the_rig_fixes_is_not_asked():
    fixed = load_rig(f'{BARE}[fixed]\nnames = ["friction.coulomb_force"]\n')
    found = diagnose(fixed, [TRAIN], [HELD_OUT])
    (row,) = [r for r in found.ranking if r.candidate.name == "coulomb_friction"]

    assert row.decided_by is DecidedBy.NOT_APPLICABLE
    assert row.reasons == ("not applicable: fixed by the rig",)


def test_a_size_that_a_rounding_parts_from_its_bound_is_at_it(problem, sound):
    name, size = sound.candidate.strength, sound.size[sound.candidate.strength]
    upper = sound.fit.plant.parameters[name].upper
    below = replace(sound, size={name: replace(size, value=np.nextafter(upper, 0.0))})

    assert reasons_against(problem.base, below) == ("its size is at a bound",)


def test_a_training_recording_that_is_to_be_validation_is_told():
    with pytest.warns(UserWarning, match="proves nothing"):
        add(load_rig(BARE), "coulomb_friction", [TRAIN], [TRAIN])
    with pytest.warns(UserWarning, match="proves nothing"):
        fit(load_rig(BARE), [TRAIN], [TRAIN])
    with pytest.raises(ValueError, match="proves nothing; expected another manoeuvre"):
        improve(load_rig(BARE), [TRAIN], [HELD_OUT, TRAIN])


def test_a_fit_of_nothing_is_refused():
    with pytest.raises(ValueError, match=r"nothing to fit: chamber\.area is"):
        fit(load_rig(BARE), [TRAIN], only=["chamber.area_m2"])


def test_an_added_strength_has_no_prior_and_one_at_its_bound_no_deviation():
    text = f'{BARE}[effects]\nadd = ["spring_force", "coulomb_friction"]\n'
    rows = {r.name: r for r in fit(load_rig(text), [bench(1, lambda v: -coulomb(v))]).rows}
    spring, dry = rows["spring_force.stiffness_n_m"], rows["friction.coulomb_force_n"]

    assert spring.prior_deviation == float("inf")
    assert not spring.flat
    assert dry.at_bound and np.isnan(dry.deviation) and not dry.flat


def test_recordings_of_two_clocks_are_refused_in_validation_too():
    slow = Recording("slow", 0.02, {k: v[::2] for k, v in HELD_OUT.channels.items()})
    slow = replace(slow, noise=HELD_OUT.noise)

    with pytest.raises(ValueError, match="slow has a sample every 20 ms and bench 1 every 10 ms"):
        pose(load_rig(BARE), [TRAIN], [slow])


def kicks(*lengths):
    """Recorded positions of a vertical cylinder at 100 Hz in pieces of so many samples."""
    n = sum(lengths)
    channels = {
        "rod.position_m": 0.1 + 0.01 * np.sin(0.01 * np.arange(n)),
        "chamber.pressure_pa": np.full(n, 2e5),
    }
    starts = tuple(int(k) for k in np.cumsum([0, *lengths[:-1]]))
    return Recording("kicks", 0.01, channels, noise={"rod.position_m": 1e-4}, starts=starts)


@pytest.mark.parametrize(
    ("recorded", "expected_s"),
    [
        (kicks(6000), 0.5),
        (kicks(6000, 3), 0.5),
        (kicks(100, 100, 99), 0.99),
        (kicks(101, 99, 101, 2), 0.99),
    ],
)
def test_kicks_stay_whole_and_stubs_shorten_no_window(recorded, expected_s):
    plant = default_rig("vertical_cylinder").fit_for(recorded)

    assert window_length_s(plant, [recorded]) == pytest.approx(expected_s)


def test_kicks_are_held_out_whole():
    (early,), (late,) = split([kicks(101, 99, 102)])

    assert [len(piece) for piece in early.pieces] == [101, 99]
    assert [len(piece) for piece in late.pieces] == [102]


def test_one_early_gap_leaves_two_thirds_to_train_on():
    (early,), (late,) = split([kicks(30, 270)])

    assert (len(early), len(late)) == (200, 100)


def test_windows_without_a_recorded_sample_say_nothing_of_the_errors():
    error = np.full((1, 30, 200), 20.0)
    weight, still, noise = np.ones(error.shape), np.zeros((1, 30)), np.ones((1, 1))
    whole = error_model(error, weight, still, noise)
    error[:, :18], weight[:, :18] = 0.0, 0.0
    part = error_model(error, weight, still, noise)

    assert part.quiet == whole.quiet == 20.0
    assert part.quiet_samples == whole.quiet_samples == 200.0


def test_a_slide_that_rests_does_not_move_beside_a_hole():
    position_m = np.full(2000, 0.1)
    position_m[900:905] = np.nan
    channels = {"slide.position_m": position_m, "valve.command_v": np.full(2000, 4.95)}
    found = regimes(servo_drive(), Recording("rest", 1e-3, channels))

    assert found["at rest"].all()
    assert "reversal" not in found

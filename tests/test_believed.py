"""What is believed of a plant: how far a diagnosis lets its parameters go."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_diagnosis import bench, coulomb
from test_fitting import NOISE, sines

from studies.hidden_cases import removed_share
from studies.text_of_results import moved_text, strained_text
from workbench.diagnosis import settle
from workbench.diagnosis.addition import accept, assembled
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.improvement import Change
from workbench.diagnosis.judge import reasons_against
from workbench.diagnosis.put_back import in_its_place
from workbench.diagnosis.refit import refit_shift
from workbench.diagnosis.result import Kind, Verdict
from workbench.diagnosis.rounds import Rounds
from workbench.diagnosis.scan import scan_catalogue
from workbench.diagnosis.shifts import shifts
from workbench.diagnosis.size import Size
from workbench.diagnosis.verdict import held
from workbench.fitting.posterior import fitted_rig, moved_parameters
from workbench.fitting.problem import BELIEVED, pose
from workbench.fitting.unknowns import WIDE, Unknowns, nominal_unknowns
from workbench.plants import servo_drive
from workbench.rig import default_rig, load_rig

FRICTION = "friction.coulomb_force_n"
TRUE_N, BELIEVED_N, DEVIATION_N = 20.0, 4.0, 1.0
RIG = load_rig(
    'name = "bench"\nplant = "cylinder_bench"\n[values]\n"chamber.area" = "518.7 mm^2"\n'
    f'"friction.coulomb_force" = "{BELIEVED_N} N"\n'
    f'[uncertainty]\n"friction.coulomb_force" = "{DEVIATION_N} N"\n'
)
NEAR_NONE_N = 5.5  # five deviations less are half a newton: no friction at all is close by
TRAIN = bench(1, lambda v: TRUE_N / 8.0 * coulomb(v))
HELD_OUT = bench(2, lambda v: TRUE_N / 8.0 * coulomb(v), gauge_pa=4e5)


@pytest.fixture(scope="module")
def believing():
    return pose(RIG, [TRAIN], [HELD_OUT], believed=BELIEVED)


@pytest.fixture(scope="module")
def found():
    return diagnose(RIG, [TRAIN], [HELD_OUT])


def test_a_diagnosis_begins_within_what_is_believed_where_a_fit_goes_on(believing):
    going_on = pose(RIG, [TRAIN], [HELD_OUT])
    ended, free = (each.base.plant.values[FRICTION] for each in (believing, going_on))

    assert ended == pytest.approx(BELIEVED_N + BELIEVED * DEVIATION_N)
    assert free > ended + 5.0 * DEVIATION_N


def test_a_parameter_that_is_held_shifts_to_where_the_recording_has_it(believing):
    (shift,) = [each for each in shifts(believing) if each.name == FRICTION]
    found = refit_shift(believing, shift)

    assert shift.leaves
    assert shift.size.value == pytest.approx(found.size[FRICTION].value, rel=0.1)
    assert found.size[FRICTION].value == pytest.approx(TRUE_N, rel=0.05)
    assert shift.drop == pytest.approx(found.drop_train, abs=0.1)


@pytest.mark.parametrize(("deviations", "left"), [(2.9, False), (3.1, True)])
def test_a_shift_is_named_where_it_leaves_its_prior_by_three_deviations(
    believing, deviations, left
):
    """The linear model that chose it to be refitted may promise more."""
    (shift,) = [each for each in shifts(believing) if each.name == FRICTION]
    size = Size(BELIEVED_N + deviations * DEVIATION_N, 1e-3, 1e-3)
    found = replace(refit_shift(believing, shift), size={FRICTION: size})
    reason = "friction.coulomb_force stays within 3 deviations of its prior"

    assert (reason not in reasons_against(believing.base, found)) == left


def test_the_sizes_of_what_leads_are_looked_for_beside_those_of_a_shift_too(monkeypatch):
    """A dead volume is a shift of what the rig has: its fitted parameter, not its strength."""
    looked_at = []
    monkeypatch.setattr(settle, "settled", lambda fit, *added: fit)
    monkeypatch.setattr(settle, "resized", lambda fit, names, rounds: looked_at.extend(names))
    volume = servo_drive().candidates["dead_volume@chamber_a"]
    settle.settled_leader(None, volume)

    assert looked_at == [volume.strength, volume.held] and volume.held.startswith("chamber_a.")


def test_a_rival_that_is_there_already_is_a_shift_without_its_prior(believing):
    found = in_its_place(believing, believing.whole.candidates["coulomb_friction"])
    unknowns = found.fit.unknowns

    assert not unknowns.with_prior[unknowns.names.index(FRICTION)]
    assert found.size[FRICTION].value == pytest.approx(TRUE_N, rel=0.05)


def test_a_parameter_that_is_held_shifts_no_further_than_its_bound():
    """Friction that drives: the recording asks for less than none."""
    values = {**RIG.plant.values, FRICTION: NEAR_NONE_N}
    rig = replace(RIG, plant=RIG.plant.with_values(values))
    problem = pose(rig, [bench(1, lambda v: -coulomb(v))], believed=BELIEVED)
    (shift,) = [each for each in shifts(problem) if each.name == FRICTION]
    found = refit_shift(problem, shift)

    assert shift.leaves
    assert shift.size.value == found.size[FRICTION].value == 0.0
    assert np.isnan(shift.size.deviation)
    assert shift.drop == pytest.approx(found.drop_train, abs=0.01)
    assert shift.drop < 0.5


def test_priors_three_times_as_wide_hold_nothing_that_is_within_them():
    """12 N instead of 4: eight deviations, of which the wide prior lets it go fifteen."""
    problem = pose(RIG, [bench(1, lambda v: 1.5 * coulomb(v))], believed=BELIEVED)
    profiles = scan_catalogue(problem)

    assert problem.base.plant.values[FRICTION] == pytest.approx(9.0)
    assert profiles[0].drop > 0.5 * problem.misfit
    assert max(each.drop_wide for each in profiles) < 0.2 * profiles[0].drop


@pytest.fixture
def drive_with():
    """The servo drive, and what it records where one of its parameters is some deviations off."""
    drive = servo_drive().lean()

    def posed(name, deviations):
        size = drive.parameters[name].standard_deviation(drive.values[name])
        other = drive.with_values({name: drive.values[name] + deviations * size})
        return pose(default_rig(drive), [sines(other, NOISE)], believed=BELIEVED)

    return posed


def test_a_fit_does_not_stop_short_of_the_end_of_what_is_believed(drive_with):
    """Where it is cut off, the others have to go with that: else every step costs more than it."""
    base = drive_with("valve.flow_area_m2", 7.0).base
    (row,) = [each for each in moved_parameters(base) if each.name == "valve.flow_area_m2"]

    assert row.far == pytest.approx(BELIEVED, rel=1e-9)
    assert row.at_bound and row.held


def test_a_shift_finds_its_way_from_the_end_at_which_it_was_held(drive_with):
    """Others have bent to imitate the leak that is not allowed: every small step costs more."""
    problem, name = drive_with("valve.leak_area_m2", 19.0), "valve.leak_area_m2"
    (shift,) = [each for each in shifts(problem) if each.name == name]
    found = refit_shift(problem, shift)

    true = problem.rig.plant.values[name] * (1.0 + 19.0 * 0.05)
    assert found.size[name].value == pytest.approx(true, rel=0.1)
    assert found.drop_train > 0.9 * min(shift.drop, 1.0) > 0.8, "nearly all, as promised"


def test_what_no_cause_can_name_is_told_where_it_is_held(drive_with, believing, found):
    """A valve's flow area is no cause of the catalogue: whatever is named may stand for it."""
    name = "valve.flow_area_m2"
    (told,) = map(str, held(drive_with(name, 7.0).base))

    assert told.startswith("valve.flow_area would go further than 5 deviations")
    assert held(believing.base) and held(drive_with(name, 1.0).base) == ()
    assert not [each for each in found.warnings if "would go further" in each]


def test_a_diagnosis_names_what_it_holds(found):
    leader = found.ranking[0]

    assert found.verdict is Verdict.FOUND
    assert (leader.candidate.name, leader.kind) == ("coulomb_friction", Kind.PARAMETER)
    assert FRICTION in [each.name for each in found.strained]
    (told,) = strained_text(found)
    assert told.endswith("friction.coulomb_force 4 N to 9 N (5 prior deviations, held there)")


def test_a_shift_that_was_accepted_may_go_as_far_as_before_in_the_next_round(found):
    """What is found later may have been part of it."""
    rig = assembled(RIG, [accept(RIG, found)])
    unknowns = nominal_unknowns(rig.plant, rig.deviations, rig.fixed, believed=BELIEVED)
    row = unknowns.names.index(FRICTION)

    assert unknowns.prior[row] == pytest.approx(TRUE_N, rel=0.05)
    assert unknowns.scale[row] == pytest.approx(DEVIATION_N)
    assert unknowns.ends[1][row] == pytest.approx(BELIEVED, rel=0.01)


def test_a_shift_that_was_accepted_is_another_value_in_the_budget_and_not_added(found):
    """The JSON of an improvement said of a friction that was there that it was added."""
    done = Rounds(RIG).told(found).added(accept(RIG, found), found)

    assert done.budget[-1].label == "+ coulomb_friction"
    assert done.budget[-1].change is Change.SHIFTED


def test_a_hidden_effect_is_seen_where_a_diagnosis_sees_it(found, monkeypatch):
    """A prior fit without an end would have taken most of it away."""
    (row,) = [each for each in found.ranking if each.candidate.name == "stiction"]
    hiding = SimpleNamespace(user_rig=lambda case: RIG, public_name=lambda case: "stiction")
    monkeypatch.setattr("studies.hidden_cases.bench_of", lambda case: hiding)
    (size, *_) = row.size.values()

    seen = removed_share(SimpleNamespace(size=size.value), TRAIN)
    assert seen == pytest.approx(row.drop_train, abs=0.05)


def test_what_is_held_is_told_with_how_far_that_is(believing):
    (row,) = [each for each in moved_parameters(believing.base) if each.name == FRICTION]

    assert np.isnan(row.deviation)
    assert "held by what is believed of it; 5 prior deviations away" in moved_text([row])


def test_what_is_held_is_written_with_the_deviation_that_it_came_with(believing):
    """The fit stopped there: it knows of it no better than before, however steep its cost is."""
    written = fitted_rig(RIG, believing.base)

    assert written.plant.values[FRICTION] == pytest.approx(4.0 + BELIEVED * DEVIATION_N)
    assert written.deviations[FRICTION] == pytest.approx(DEVIATION_N)


def test_only_what_has_a_prior_is_bounded_by_it():
    rows = np.array([[10.0, 10.0], [1.0, 1.0], [0.0, 0.0], [100.0, 12.0]])
    known = Unknowns(("a", "b"), *rows, np.array([1.0, 1.0]), reach=5.0)
    added = Unknowns(("a", "b"), *rows, np.array([1.0, WIDE**-2]), reach=5.0)

    assert [*zip(*known.ends, strict=True)] == [(-5.0, 5.0), (-5.0, 2.0)]
    assert [*zip(*added.ends, strict=True)] == [(-5.0, 5.0), (-10.0, 2.0)]
    assert [*zip(*known.trusting(0).ends, strict=True)] == [(-10.0, 90.0), (-5.0, 2.0)]
    assert known.values(np.array([-7.0, 7.0])) == {"a": 5.0, "b": 12.0}


def test_a_narrow_prior_of_a_fit_does_not_narrow_what_is_believed():
    """A rig that was fitted while it lacked something is too sure of its parameters."""
    plant = RIG.plant
    usual = plant.parameters["atmosphere.pressure_pa"].standard_deviation(
        plant.values["atmosphere.pressure_pa"]
    )
    sure, unsure = (
        nominal_unknowns(plant, {"atmosphere.pressure_pa": share * usual}, believed=BELIEVED)
        for share in (0.1, 2.0)
    )
    for found, reach in (sure, BELIEVED * usual), (unsure, 2.0 * BELIEVED * usual):
        row = found.names.index("atmosphere.pressure_pa")
        below, above = (float(each[row]) * found.scale[row] for each in found.ends)
        assert (below, above) == (pytest.approx(-reach), pytest.approx(reach))


def test_what_was_added_goes_as_far_as_there_is_at_the_price_of_its_prior():
    """It came in while something else was missing, and may have imitated that."""
    text = (
        'name = "bench"\nplant = "cylinder_bench"\n[effects]\nadd = ["constant_force"]\n'
        '[values]\n"constant_force.force" = "1 N"\n'
        '[uncertainty]\n"constant_force.force" = "0.1 N"\n'
    )
    rig = load_rig(text)
    added = rig.added_to(rig.plant)
    found = nominal_unknowns(rig.plant, rig.deviations, rig.held, added, believed=BELIEVED)
    row = found.names.index("constant_force.force_n")
    below, above = (float(each[row]) * found.scale[row] for each in found.ends)

    assert found.scale[row] == pytest.approx(0.1) and found.with_prior[row]
    assert below < -10.0 and above > 10.0
    others = [k for k in range(len(found)) if k != row]
    assert others and np.isfinite(found.ends[0][others]).all()

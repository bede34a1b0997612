"""What is told of a held-out recording: by which weights, and where nothing can be told."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_fitting_corners import errors
from test_report import diagnosis

from studies.documents import diagnosis_document
from studies.figures.diagnosis import diagnosis_figures
from studies.hidden_benches import SERVO_DRIVE
from studies.hidden_effects import recordings
from studies.page.missing_term import _head
from studies.text_of_results import where_text
from studies.truth.cases import read_cases
from workbench.consistency import check, trusted
from workbench.consistency.noise import untold_noise
from workbench.diagnosis import credible as crediting
from workbench.diagnosis.addition import add
from workbench.diagnosis.credible import credible
from workbench.diagnosis.ranking import _reason_not_asked
from workbench.diagnosis.result import Verdict
from workbench.fitting.errors import plain_chance, plain_ratio
from workbench.fitting.unknowns import nominal_unknowns
from workbench.recording import Recording
from workbench.rig import default_rig, load_rig

ADDED = """plant = "servo_drive"
[effects]
add = ["chamber_leak@chamber_b", "stiction"]
[values]
"chamber_leak@chamber_b.area" = "{area} mm^2"
[uncertainty]
"chamber_leak@chamber_b.area" = "0.002 mm^2"
"""


@pytest.mark.slow
def test_held_out_errors_with_an_effect_are_weighed_by_what_is_left_with_it():
    """By those of the rig without it the position was told ten times further off than it is."""
    case = read_cases(SERVO_DRIVE.truth.stored)["coulomb_friction", 1]
    case = replace(case, differences=())
    ((train, held_out),) = recordings([case])

    after = add(SERVO_DRIVE.user_rig(case), "coulomb_friction", [train], [held_out]).after

    for name, error in after["validation"].items():
        assert error.rmse < 1.5 * after["train"][name].rmse


def test_an_effect_that_was_added_goes_on_from_what_its_fit_found():
    """It was free again whatever the rig file said of it; what is absent yet has no prior."""
    rig = load_rig(ADDED.format(area=0.12))
    leak, stiction = (rig.plant.candidates[n] for n in ("chamber_leak@chamber_b", "stiction"))
    unknowns = nominal_unknowns(rig.plant, rig.deviations, added=[leak, stiction])
    rows = [unknowns.names.index(each.strength) for each in (leak, stiction)]

    assert unknowns.with_prior[rows].tolist() == [True, False]
    assert unknowns.prior[rows[0]] == pytest.approx(0.12e-6)
    assert unknowns.scale[rows[0]] == pytest.approx(0.002e-6)


def test_what_is_told_of_an_effect_that_is_absent_holds_no_candidate():
    rig = load_rig(ADDED.format(area=0.0))
    leak = rig.plant.candidates["chamber_leak@chamber_b"]
    unknowns = nominal_unknowns(rig.plant, rig.deviations, added=[leak])

    assert not unknowns.with_prior[unknowns.names.index(leak.strength)]


@pytest.mark.parametrize(("missed", "contradicted"), [(0.4, False), (0.95, True)])
def test_a_crowd_explains_what_its_leader_does(monkeypatch, missed, contradicted):
    """Nobody can tell which it is, but that is no contradiction of rig and recording."""
    left = {"base": {"slide.position_m": 2.4}, "leader": {"slide.position_m": missed}}
    monkeypatch.setattr(crediting, "left_unexplained", lambda fit: left[fit])
    found = diagnosis(Verdict.RECORDING_TOO_WEAK)
    leader = replace(found.ranking[0], fit="leader", crowd=("a", "b", "c"))
    found = replace(found, ranking=(leader,), base="base", base_validation=None)

    assert credible(found, ()).contradicted == contradicted


def test_a_refused_leader_explains_nothing(monkeypatch):
    monkeypatch.setattr(crediting, "left_unexplained", lambda fit: {"slide.position_m": fit})
    found = diagnosis(Verdict.RECORDING_TOO_WEAK)
    refused = replace(found.ranking[0], fit=0.1, accepted=False)
    found = replace(found, ranking=(refused,), base=2.4, base_validation=None)

    assert credible(found, ()).contradicted


def slow_position(step):
    """A stroke of 0.2 m with noise of 0.02 mm, seen at every so many-th sample."""
    time_s = 1e-3 * np.arange(8000)
    noise_m = 2e-5 * np.random.default_rng(4).standard_normal(8000)
    position_m = 0.14 + 0.1 * np.sin(9.0 * time_s) + noise_m
    position_m[np.arange(8000) % step > 0] = np.nan
    command = {"valve.command_v": np.full(8000, 5.0)}
    return Recording("r", 1e-3, {"slide.position_m": position_m, **command})


def test_a_sensor_whose_motion_passes_for_noise_is_told_before_a_fit():
    """Compare alone told it: 17 mm of noise, where 0.02 are, take the position out of a fit."""
    (finding,) = untold_noise(default_rig("servo_drive"), [slow_position(100)])

    assert finding.channel == "slide.position"
    assert "differences of its samples tell" in finding.what and "noise = ..." in finding.remedy
    assert not untold_noise(default_rig("servo_drive"), [slow_position(1)])
    known = replace(slow_position(100), noise={"slide.position_m": 2e-5})
    assert not untold_noise(default_rig("servo_drive"), [known])


def test_a_still_piece_of_one_recording_tells_the_noise_of_all_that_are_fitted():
    rig, moving = default_rig("servo_drive"), slow_position(100)
    resting = slow_position(1)
    resting["slide.position_m"][:] = 0.14 + 2e-5 * np.random.default_rng(5).standard_normal(8000)
    only = ("valve.command_v", "chamber_a.pressure_pa")
    elsewhere = replace(moving, channels={name: moving["valve.command_v"] for name in only})

    assert not untold_noise(rig, [moving, resting])
    assert [each.channel for each in untold_noise(rig, [moving, elsewhere])] == ["slide.position"]


def test_noise_of_a_held_out_recording_is_that_of_the_training(monkeypatch):
    asked = []
    monkeypatch.setattr(check, "untold_noise", lambda rig, train: asked.append(train) or [])
    train, held_out = slow_position(1), slow_position(100)
    trusted(default_rig("servo_drive"), [train], [held_out])

    assert [[each.name for each in group] for group in asked] == [[train.name]]
    assert np.isfinite(asked[0][0]["slide.position_m"]).all()


def test_an_output_of_one_window_makes_no_chance_of_the_others():
    """Without that window there are no errors of it, which are no ratio of nothing to nothing."""
    before, after = errors(1.0), errors(1.0)
    for fit in (before, after):
        fit.windows.measured[1, 1:], fit.residual[1, 1:] = np.nan, 0.0
    after.residual[1] *= 2.0

    assert plain_ratio(before, after) == pytest.approx(2.0)
    assert plain_chance(before, after) == pytest.approx(0.75 * np.log(2.0), rel=1e-6)


def test_a_term_that_is_no_more_than_chance_is_not_drawn_as_what_is_missing():
    found = diagnosis()
    gains = {"chamber_a.mass": 2.0, "slide.momentum": 0.0}
    vague = replace(found, where=replace(found.where, by_balance=gains))
    titles = [
        [axes.get_title() for axes in diagnosis_figures(each)["missing_term"].axes]
        for each in (found, vague)
    ]

    assert any("lacks" in title for title in titles[0]) and "which balance" in titles[0]
    assert any("hardly more than chance" in title for title in titles[1])
    assert "no balance stands out" in titles[1]


@pytest.mark.parametrize(
    ("gains", "head", "marked"),
    [
        ((178.0, 3.0), "the balance chamber a energy", ["chamber_a.energy"]),
        ((178.0, 175.0), "one of the balances chamber a energy, chamber a mass",
         ["chamber_a.energy", "chamber_a.mass"]),
        ((2.0, 0.0), "no balance stands out", []),
    ],
    ids=["one", "alike", "none"],
)  # fmt: skip
def test_page_and_json_are_as_sure_of_a_balance_as_the_figure(gains, head, marked):
    names = ("chamber_a.energy", "chamber_a.mass")
    found = diagnosis()
    by_balance = dict(zip(names, gains, strict=True))
    where = replace(found.where, balance=names[0], by_balance=by_balance)
    told = diagnosis_document(replace(found, where=where), {})["where"]

    assert list(where.marked) == marked
    assert _head([each.replace("_", " ").replace(".", " ") for each in marked]).count(head) == 1
    assert ([told["balance"], *told["alike"]] if told["certain"] else []) == marked


def test_the_balance_of_a_law_stands_though_another_gains_more():
    gains = {"chamber_a.mass": 2.0, "slide.momentum": 90.0}
    found = diagnosis(Verdict.NOT_IN_CATALOGUE)
    found = replace(found, where=replace(found.where, by_balance=gains, by_law=True))
    told = diagnosis_document(found, {})["where"]

    assert (told["balance"], told["certain"], told["alike"]) == ("chamber_a.mass", True, [])
    assert "the law acts in chamber_a.mass" in where_text(found)


def test_balances_that_gain_alike_are_both_marked():
    where = diagnosis().where
    alike = replace(where, by_balance={"chamber_a.energy": 178.0, "chamber_a.mass": 175.0})

    assert where.alike == () and alike.alike == ("chamber_a.energy",)


def test_reasons_name_parameters_as_rig_files_do():
    plant = default_rig("servo_drive").plant
    stiction = plant.candidates["stiction"]
    bare = plant.with_values({stiction.needed: 0.0})
    problem = SimpleNamespace(whole=bare, rig=SimpleNamespace(plant=bare))

    assert _reason_not_asked(problem, stiction) == "nothing without friction.coulomb_force"

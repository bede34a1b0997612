"""Refits that begin at the priors, where the prior fit is far from them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_diagnosis import bench, coulomb

from studies.hidden_answers import widened
from studies.hidden_benches import GEARBOX, SERVO_DRIVE
from studies.hidden_effects import answer, recordings
from studies.truth.cases import read_cases
from workbench.diagnosis import follow, refit
from workbench.diagnosis.diagnose import silent
from workbench.diagnosis.scan import scan_from_priors
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.linearised import Point
from workbench.fitting.problem import pose
from workbench.fitting.unknowns import Unknowns
from workbench.rig import load_rig


def profile(name, drop):
    return SimpleNamespace(candidate=SimpleNamespace(name=name), drop=drop)


def from_priors(t, profiles, monkeypatch, kept=(), removed=0.0):
    """Names of what is refitted from the priors, the last unknown being without one.

    First fits have ``kept`` these shares by name, and the best refit ``removed`` one.
    """
    monkeypatch.setattr(follow, "refit_from_priors", lambda problem, one: one.candidate.name)
    monkeypatch.setattr(follow, "_best_share", lambda refits: removed)
    wide, one = np.full(3, np.inf), np.ones(3)
    precision = np.array([1.0, 1.0, 1e-4])
    unknowns = Unknowns(("core", "damping", "added"), 0 * one, one, -wide, wide, precision)
    base = SimpleNamespace(point=SimpleNamespace(t=np.array(t)), unknowns=unknowns)
    problem = SimpleNamespace(base=base, misfit=100.0)
    first = dict(kept).items()
    begun = [SimpleNamespace(profile=profile(name, 0.0), share=share) for name, share in first]
    return [*follow._from_priors(problem, profiles, begun, [], silent)]


ALL_KEPT = {"delay": 0.9, "line": 0.6, "leak": 0.8}


@pytest.mark.parametrize(
    ("t", "refitted"),
    [
        ([1.0, -3.0, 0.0], []),
        ([1.0, -3.0, 40.0], []),
        ([1.0, -5.0, 0.0], ["delay", "line"]),
    ],
)
def test_only_where_a_prior_is_left_far_behind_what_leads_there_is_refitted(
    t, refitted, monkeypatch
):
    leaders = [profile("delay", 9e3), profile("line", 8e3), profile("leak", 7e3)]

    assert from_priors(t, leaders, monkeypatch, ALL_KEPT) == refitted


def test_what_explains_far_less_at_the_priors_or_less_than_is_left_is_not_refitted(monkeypatch):
    far, two = [0.0, 5.0, 0.0], [profile("delay", 9e3), profile("leak", 3e3)]

    assert from_priors(far, two, monkeypatch, ALL_KEPT) == ["delay"]
    assert from_priors(far, [profile("delay", 90.0)], monkeypatch, ALL_KEPT) == []


@pytest.mark.parametrize(
    ("t", "kept", "removed", "refitted"),
    [
        ([0.0, 2.0, 0.0], {"underlap": -0.15}, 0.2, ["underlap"]),
        ([0.0, 2.0, 0.0], {}, 0.2, ["underlap"]),
        ([0.0, 1.0, 0.0], {"underlap": -0.15}, 0.2, []),  # nothing has moved that could imitate it
        ([0.0, 2.0, 0.0], {"underlap": 0.3}, 0.2, []),  # the first fit kept more than half of it
        ([0.0, 2.0, 0.0], {"underlap": -0.15}, 0.6, []),  # another removes most of the misfit
    ],
)
def test_what_leads_at_the_priors_and_is_lost_by_its_first_fit_is_refitted_from_there(
    t, kept, removed, refitted, monkeypatch
):
    """Wide priors: a leak and the law of an area stand in for an underlap two deviations away."""
    assert from_priors(t, [profile("underlap", 52.0)], monkeypatch, kept, removed) == refitted


def test_what_promises_less_than_the_least_share_is_not_refitted_from_the_priors(monkeypatch):
    assert from_priors([0.0, 2.0, 0.0], [profile("lag", 19.0)], monkeypatch, {"lag": 0.0}) == []


def test_of_refits_of_one_candidate_the_lowest_stays_in_its_place():
    def refitted(name, cost):
        return SimpleNamespace(candidate=SimpleNamespace(name=name), fit=SimpleNamespace(cost=cost))

    first = [refitted("delay", 5.0), refitted("leak", 4.0)]
    again = [refitted("delay", 3.0), refitted("leak", 6.0), refitted("line", 7.0)]

    assert follow._lowest(first, again) == [again[0], first[1], again[2]]


def test_a_refit_from_the_priors_begins_weighed_by_its_own_errors_too(monkeypatch):
    """It is found where weights of the base lead nowhere: here that fit makes no step at all."""
    rig = load_rig('plant = "cylinder_bench"\n[values]\n"chamber.area" = "518.7 mm^2"\n')
    problem = pose(rig, [bench(1, coulomb)])
    (profile,) = (p for p in scan_from_priors(problem) if p.candidate.name == "coulomb_friction")
    found = refit.refit_from_priors(problem, profile)

    stuck = []

    def lost(begun, fits):
        windows, unknowns, t = begun
        stuck.append(fit_windows(windows, unknowns, Point(t, windows.start), iterations=0))
        return stuck[-1]

    monkeypatch.setattr(refit, "_fitted_near", lost)
    alone = refit.refit_from_priors(problem, profile)

    assert stuck[0].cost > 2.0 * found.fit.cost
    assert alone.fit.cost == pytest.approx(found.fit.cost, rel=1e-2)
    assert alone.size["friction.coulomb_force_n"].value == pytest.approx(8.0, rel=0.05)


@pytest.mark.slow
def test_a_late_command_that_parameters_of_its_valve_imitate_together_is_found():
    """Voltage, core, armature and damping of a valve go five deviations each for 5.7 ms.

    So it is where the pressure sensors are fast; from the prior fit no first fit finds the delay.
    """
    case = read_cases(GEARBOX.truth.stored)["command_delay", 2]
    differences = (each for each in case.differences if each.field != "pressure_lag_s")
    case = replace(case, differences=tuple(differences))
    (recorded,) = recordings([case])
    first = answer(case, *recorded, GEARBOX.user_rig(case)).diagnosis.ranking[0]

    assert first.accepted
    assert "command_delay@valve_1" in (first.candidate.name, *first.tied_with)


@pytest.mark.slow
def test_an_underlap_that_others_imitate_within_wide_priors_is_found():
    """A leak of the spool and the law of its area: at 5 % they go further, and a first fit sees."""
    case = read_cases(SERVO_DRIVE.truth.stored)["valve_underlap", 2]
    (recorded,) = recordings([case])
    rig = widened(SERVO_DRIVE.user_rig(case), 3.0)
    first = answer(case, *recorded, rig).diagnosis.ranking[0]

    assert first.accepted
    assert first.candidate.name == "valve_underlap"
    assert first.size["valve.underlap_v"].value == pytest.approx(case.size, rel=0.15)

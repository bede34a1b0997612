"""Refits that begin at the priors, where the prior fit is far from them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_diagnosis import bench, coulomb

from studies.hidden_benches import GEARBOX
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


def from_priors(t, profiles, monkeypatch):
    """Names of what is refitted from the priors, the last unknown being without one."""
    monkeypatch.setattr(follow, "refit_from_priors", lambda problem, one: one.candidate.name)
    wide, one = np.full(3, np.inf), np.ones(3)
    precision = np.array([1.0, 1.0, 1e-4])
    unknowns = Unknowns(("core", "damping", "added"), 0 * one, one, -wide, wide, precision)
    base = SimpleNamespace(point=SimpleNamespace(t=np.array(t)), unknowns=unknowns)
    problem = SimpleNamespace(base=base, misfit=100.0)
    return [*follow._from_priors(problem, profiles, silent)]


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

    assert from_priors(t, leaders, monkeypatch) == refitted


def test_what_explains_far_less_at_the_priors_or_less_than_is_left_is_not_refitted(monkeypatch):
    far = [0.0, 5.0, 0.0]

    assert from_priors(far, [profile("delay", 9e3), profile("leak", 3e3)], monkeypatch) == ["delay"]
    assert from_priors(far, [profile("delay", 90.0)], monkeypatch) == []


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

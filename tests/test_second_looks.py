"""Beside the ranking of the scan: priors three times as wide, and the classical score."""

from dataclasses import replace

import numpy as np
import pytest
from test_diagnosis import bench, coulomb, nothing
from test_report import ranked

from studies.hidden_answers import widened
from workbench.diagnosis.metric import metric_at
from workbench.diagnosis.result import Verdict
from workbench.diagnosis.scan import WIDER, scan, scan_from_priors
from workbench.diagnosis.score import modification_index
from workbench.diagnosis.verdict import unsteady
from workbench.fitting.problem import pose
from workbench.rig import load_rig

FORCE = "constant_force.force_n"


@pytest.fixture(scope="module")
def rig():
    return load_rig('name = "bench"\nplant = "cylinder_bench"\n')


def scanned(problem, unknowns=None):
    base = problem.base
    absent = [c for c in problem.whole.candidates.values() if c.held is None and not c.cause.needs]
    at = problem.linearised
    return scan(problem.whole, base.windows, unknowns or base.unknowns, base.point, absent, at)


@pytest.fixture(scope="module")
def pushed(rig):
    """A problem in which 3 N are missing, and its scan by name."""
    problem = pose(rig, [bench(1, nothing, 3.0)])
    return problem, {each.candidate.name: each for each in scanned(problem)}


def drop_at(problem, force_n):
    """Fall of the projected cost with a constant force, simulated over all windows."""
    base = problem.base
    plant = problem.whole.lean(keep=["constant_force"])
    windows = base.windows.with_plant(plant)
    values = {n: v for n, v in base.plant.values.items() if n in plant.values}
    residual = windows.residuals([plant.with_values({**values, FORCE: force_n})], base.point.starts)
    metric = metric_at(base.windows, base.unknowns, base.point, problem.linearised)
    return metric.cost - metric.explained(metric.rows(residual)[0])[0]


@pytest.mark.parametrize("wider", [1.0, 3.0])
def test_a_scan_from_the_priors_finds_what_the_prior_fit_imitates(rig, wider):
    """3 N look like another ambient pressure: 1.8 deviations off, or hardly any of wide ones."""
    problem = pose(widened(rig, wider), [bench(1, nothing, 3.0)])

    assert scan_from_priors(problem)[0].candidate.name == "constant_force"


def test_the_drop_with_wide_priors_is_that_of_a_scan_with_wide_priors(rig):
    problem = pose(rig, [bench(1, coulomb, 3.0)])
    unknowns = problem.base.unknowns
    wide = replace(unknowns, precision=unknowns.precision / WIDER**2)
    again = {each.candidate.name: each.drop for each in scanned(problem, wide)}
    found = {each.candidate.name: each for each in scanned(problem)}

    for name, each in found.items():
        assert each.drop_wide == pytest.approx(again[name], rel=1e-6, abs=1e-6)
    assert again["constant_force"] < 0.98 * found["constant_force"].drop


def test_the_index_of_a_linear_effect_is_the_most_that_it_brings(pushed):
    problem, profiles = pushed
    known = problem.whole.parameters[FORCE]
    most = max(drop_at(problem, force_n) for force_n in np.linspace(-6.0, 0.0, 121))

    assert modification_index(profiles["constant_force"], known) == pytest.approx(most, rel=0.05)


def test_a_bound_keeps_the_index_to_what_is_within_it(pushed):
    problem, profiles = pushed
    known = replace(problem.whole.parameters[FORCE], lower=-1.0, upper=1.0)

    bounded = modification_index(profiles["constant_force"], known)
    assert bounded == pytest.approx(drop_at(problem, -1.0), rel=0.05)


def test_a_forbidden_sign_has_no_index(rig):
    """Friction that drives."""
    problem = pose(rig, [bench(1, lambda v: -150.0 * v)])
    profiles = {each.candidate.name: each for each in scanned(problem)}
    known = problem.whole.parameters

    for name in ("viscous_friction", "coulomb_friction"):
        profile = profiles[name]
        assert modification_index(profile, known[profile.candidate.strength]) == 0.0
    assert modification_index(profiles["constant_force"], known[FORCE]) >= 0.0


def test_another_first_name_with_wide_priors_is_warned_of(pushed):
    _, profiles = pushed
    first, second, *_ = sorted(profiles.values(), key=lambda each: -each.drop)
    better = replace(second, drop_wide=2.0 * first.drop_wide + 1.0)
    row = ranked(first.candidate, 0.5)
    tied = replace(row, tied_with=(second.candidate.name,))
    (said,) = map(str, unsteady((row,), [first, better], Verdict.FOUND))

    name = second.candidate.name
    assert said == f"with priors 3 times as wide {name} would lead the scan"
    assert unsteady((row,), [first, replace(second, drop_wide=0.0)], Verdict.FOUND) == ()
    assert unsteady((tied,), [first, better], Verdict.TIE) == ()
    assert unsteady((row,), [first, better], Verdict.NOTHING_MISSING) == ()

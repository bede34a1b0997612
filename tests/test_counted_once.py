"""What a diagnosis counts, it counts once: samples, windows, priors, and what falls below noise."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter
from test_diagnosis import bench, coulomb, nothing

from workbench.diagnosis import follow as following
from workbench.diagnosis import settle
from workbench.diagnosis.diagnose import silent
from workbench.diagnosis.follow import _best_first, follow
from workbench.diagnosis.judge import SHARE_REASON, reasons_against, share_removed
from workbench.diagnosis.pairs import _leaves_less
from workbench.diagnosis.ranking import ranked
from workbench.diagnosis.refit import refit_shift
from workbench.diagnosis.scan import scan, scan_from_priors
from workbench.diagnosis.shifts import shifts
from workbench.fitting.error_model import error_model
from workbench.fitting.linearised import Point, normal_equations
from workbench.fitting.problem import pose
from workbench.rig import load_rig

BARE = 'name = "bench"\nplant = "cylinder_bench"\n[values]\n"chamber.area" = "518.7 mm^2"\n'
VISCOUS = f'{BARE}"friction.viscous" = "40 N s/m"\n[uncertainty]\n"friction.viscous" = "5 %"\n'
RUBBING = f'{BARE}"friction.coulomb_force" = "8 N"\n'


@pytest.fixture(scope="module")
def problem():
    return pose(load_rig(BARE), [bench(1, coulomb)], [bench(2, coulomb, gauge_pa=4e5)])


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.8, 0.9])
def test_the_correlation_time_of_errors_is_their_integrated_one(memory):
    """e[k] = a e[k-1] + w has tau = (1 + a) / (1 - a); windows of 200 samples."""
    drive = np.random.default_rng(3).standard_normal((1, 2000, 200))
    error = lfilter([1.0], [1.0, -memory], drive, axis=2)
    moves, noise = np.ones((1, 2000)), np.array([[1e-3]])

    found = error_model(error, np.ones_like(error), moves, noise)

    assert found.moving_samples == pytest.approx((1 + memory) / (1 - memory), rel=0.2)


def test_windows_that_stand_for_two_each_weigh_against_the_priors_as_two(problem):
    at, unknowns = problem.linearised, problem.base.unknowns
    twice = at.part(np.repeat(np.arange(len(problem.base.windows)), 2))
    at = replace(at, point=replace(at.point, t=at.point.t + 0.5))
    twice = replace(twice, point=replace(twice.point, t=at.point.t))
    all_of_them, half = normal_equations(twice, unknowns), normal_equations(at, unknowns, each=2.0)

    np.testing.assert_allclose(2.0 * half.hessian, all_of_them.hessian, rtol=1e-9)
    np.testing.assert_allclose(2.0 * half.gradient, all_of_them.gradient, rtol=1e-9)


def test_a_scan_of_some_windows_from_the_priors_counts_for_all():
    """So do the priors: a viscous friction that is half known imitates another one's part."""
    problem = pose(load_rig(VISCOUS), [bench(1, coulomb)], [bench(2, coulomb, gauge_pa=4e5)])
    base = problem.base
    few, kept = base.windows.part(max(len(base.windows) // 4, 12))
    point = Point(problem.at_priors, base.point.starts[:, kept])
    found = {each.candidate.name: each for each in scan_from_priors(problem)}
    name = "coulomb_friction"
    ratio, candidate = len(base.windows) / len(few), problem.whole.candidates[name]
    lighter = replace(base.unknowns, precision=base.unknowns.precision / ratio)
    (own,) = scan(problem.whole, few, lighter, point, [candidate])
    (stiff,) = scan(problem.whole, few, base.unknowns, point, [candidate])

    assert len(few) < len(base.windows)
    assert found[name].drop == pytest.approx(ratio * own.drop, rel=1e-6)
    assert found[name].trials[0].shown == pytest.approx(ratio * own.trials[0].shown, rel=1e-6)
    assert found[name].trials[0].shown != pytest.approx(ratio * stiff.trials[0].shown, rel=1e-4)


def test_at_the_priors_what_has_none_stays_form_and_all(problem):
    """An amplitude with another phase is worse than none."""
    unknowns, point = problem.base.unknowns, problem.base.point
    free = np.arange(len(unknowns)) < 2  # a strength and its form
    added = replace(unknowns, precision=np.where(free, 1e-6, 1.0))
    moved = replace(point, t=np.arange(1.0, len(unknowns) + 1.0))
    there = replace(problem, base=replace(problem.base, unknowns=added, point=moved))

    np.testing.assert_array_equal(there.at_priors, np.where(free, moved.t, 0.0))


def test_of_a_parameter_the_rig_has_too_much_of_the_size_is_how_far_it_goes():
    """A bench without friction, of which the rig believes 8 N: they go, and that is no trifle."""
    problem = pose(load_rig(RUBBING), [bench(1, nothing)], [bench(2, nothing, gauge_pa=4e5)])
    (shift,) = (s for s in shifts(problem) if s.candidate.name == "coulomb_friction")
    found = refit_shift(problem, shift)

    assert abs(found.size["friction.coulomb_force_n"].value) < 0.1
    assert found.drop_train > 0.9 and found.drop_validation > 0.9
    assert reasons_against(problem.base, found) == ()


def test_what_fails_by_its_share_alone_stands_before_what_fails_otherwise(problem, monkeypatch):
    rows = {
        "bound": (0.30, ("its size is at a bound",)),
        "proxy": (0.15, (SHARE_REASON,)),
        "dust": (0.02, (SHARE_REASON,)),
        "sound": (0.10, ()),
    }
    refits = [
        SimpleNamespace(name=name, drop_train=drop, drop_validation=drop)
        for name, (drop, _) in rows.items()
    ]
    monkeypatch.setattr(following, "reasons_against", lambda base, each: rows[each.name][1])
    monkeypatch.setattr(following, "predicts", lambda each: True)

    order = [each.name for each in _best_first(problem, refits)]
    assert order == ["sound", "proxy", "bound", "dust"]


def test_shares_beyond_all_of_it_count_as_all():
    def fell(train, held_out):
        return SimpleNamespace(drop_train=train, drop_validation=held_out)

    assert share_removed(fell(0.12, 2.0)) == pytest.approx(0.56)
    assert share_removed(fell(1.3, float("nan"))) == 1.0
    assert not _leaves_less(fell(1.012, 1.0), fell(1.0, 0.9))
    assert not _leaves_less(fell(0.99, 1.0), fell(0.97, 0.9))
    assert _leaves_less(fell(0.90, 0.9), fell(0.80, 0.8))


def test_a_settled_size_that_would_not_pass_is_not_told(problem, monkeypatch):
    followed = follow(problem, None, silent)
    (leader, *_) = ranked(problem, followed.profiles, followed.refits, [], {})
    steady = settle._settled_row(problem, leader, True)
    monkeypatch.setattr(settle, "size_reasons", lambda base, row: ["its size is negligible"])

    assert leader.accepted and steady.size != leader.size
    assert settle._settled_row(problem, leader, True) is leader

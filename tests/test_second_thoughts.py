"""Backward and swap pass where effects hang on each other: one needs another, or came on top."""

from dataclasses import replace
from math import isnan
from types import SimpleNamespace

import numpy as np
import pytest
from test_diagnosis import bench, coulomb, nothing
from test_improvement import BARE, steps_of

from studies.improvement_text import improvement_text
from workbench.diagnosis import improve as improvement
from workbench.diagnosis import passes as passing
from workbench.diagnosis import put_back, settle
from workbench.diagnosis.diagnose import diagnose, silent
from workbench.diagnosis.improve import improve
from workbench.diagnosis.judge import HELD_OUT_REASON
from workbench.diagnosis.passes import Kept, Passes
from workbench.diagnosis.rounds import Rounds
from workbench.diagnosis.settle import settled_leader
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.linearised import Point
from workbench.fitting.problem import Problem, improved_base, pose, staged
from workbench.fitting.unknowns import nominal_unknowns
from workbench.fitting.windows import cut_windows
from workbench.recording import Recording
from workbench.rig import default_rig, load_rig
from workbench.simulation import simulate

SETS = [bench(1, coulomb, 5.0), bench(3, coulomb, 5.0, 1e5)], [bench(2, coulomb, 5.0, 4e5)]
BLANK = [bench(1, nothing), bench(3, nothing, 0.0, 1e5)], [bench(2, nothing, 0.0, 4e5)]


@pytest.fixture(scope="module")
def rig():
    return load_rig(BARE)


def test_no_rival_takes_the_place_of_what_a_kept_effect_needs(rig, monkeypatch):
    """Static friction is what Coulomb's is exceeded by: without it, it means nothing."""
    monkeypatch.setattr(passing, "clearly_better", lambda *asked: True)
    kept = steps_of(rig, SETS, "coulomb_friction", "stiction")
    passes = Passes(rig, *SETS, {"coulomb_friction": diagnose(rig, *SETS)}, silent)

    assert passes._rivals(kept, kept.steps[0])
    assert passes.swaps(kept, kept.steps[0]) == ([], kept)


def test_what_is_left_alone_is_asked_against_the_rig_as_it_came(rig, monkeypatch):
    """Neither is needed; the second was judged on top of the first alone."""
    kept = steps_of(rig, BLANK, "viscous_friction", "constant_force")
    done = Rounds(rig, kept=kept, steps=kept.steps).told(diagnose(rig, *BLANK))
    monkeypatch.setattr(improvement, "forward", lambda *asked: done)
    found = improve(rig, *BLANK)

    assert [each.candidate.name for each in found.removals] == list(kept.names)
    assert all(each.dropped and each.reasons for each in found.removals)
    assert found.kept == () and found.rig is rig
    assert "constant_force" in improvement_text(found, {"rod.force": "rod.force_n"})


def test_what_is_needed_is_asked_after_what_needs_it(rig, monkeypatch):
    """Where stiction goes, what stands only because stiction needs it is asked too."""
    kept = steps_of(rig, SETS, "coulomb_friction", "stiction", "constant_force")
    done = Rounds(rig, kept=kept, steps=kept.steps).told(diagnose(rig, *SETS))
    monkeypatch.setattr(passing, "reasons_against", lambda *asked: ("brings nothing",))
    monkeypatch.setattr(passing, "leaves_more", lambda *asked: False)
    found = improvement._thought_over(done, *SETS, silent)

    asked = {each.candidate.name: each for each in found.removals}
    assert [*asked] == ["stiction", "coulomb_friction", "constant_force"]
    assert all(each.dropped for each in asked.values())
    assert all(each.reasons == ("brings nothing",) for each in asked.values())


def test_the_order_of_asking_is_that_of_coming_in_where_none_needs_another(rig):
    kept = steps_of(rig, SETS, "coulomb_friction", "viscous_friction", "stiction")
    needed, other, needing = kept.steps
    passes = Passes(rig, *SETS, {}, silent)

    assert passes.in_turn((needed, other)) == (needed, other)
    assert passes.in_turn(kept.steps) == (other, needing, needed)
    assert passes.in_turn((needing, needed, other)) == (needing, needed, other)


def test_a_rival_that_takes_a_place_has_its_size_settled_like_any_addition(rig, monkeypatch):
    """Its refit weighs errors as the model without it made them, and stops short."""
    wrong = steps_of(rig, SETS, "viscous_friction", "constant_force")
    passes = Passes(rig, *SETS, {"viscous_friction": diagnose(rig, *SETS)}, silent)
    asked = []

    def settled(fit, candidate):
        asked.append((fit, candidate.name))
        return settled_leader(fit, candidate)

    monkeypatch.setattr(settle, "settled_leader", settled)
    tried, better = passes.swaps(wrong, wrong.steps[0])
    ((refitted, name),) = asked

    assert tried[-1].replaced and name == "coulomb_friction" == tried[-1].rival.name
    assert tried[-1].addition is better.steps[-1]
    assert better.fit is better.steps[-1].fit is not refitted
    assert better.validation is better.steps[-1].validation_fit
    assert better.fit.windows.scale.max() < 0.5 * refitted.windows.scale.max()


@pytest.mark.parametrize(
    ("fails", "stays"), [(HELD_OUT_REASON, True), ("its size is negligible", False)]
)
def test_what_the_held_out_recording_alone_refuses_stays_where_both_errors_grow_without_it(
    fails, stays, rig, monkeypatch
):
    """It is refused by the weights of what misses far more.

    So a leak was dropped beside a droop, and chi2 per sample went from 95 to 720.  A force that
    comes back as next to none is not needed, whatever the fit of all was before.
    """
    monkeypatch.setattr(passing, "reasons_against", lambda base, found: (fails,))
    kept = steps_of(rig, SETS, "coulomb_friction", "constant_force")

    removal, rest = Passes(rig, *SETS, {}, silent).removal(kept, kept.steps[0])

    assert removal.dropped == (not stays)
    if stays:
        assert rest is kept and isnan(removal.share_train) and isnan(removal.share_validation)
        assert removal.reasons[0].startswith("without it chi2 per sample grows from ")
    else:
        assert rest.names == ("constant_force",) and removal.reasons == (fails,)


def test_what_is_fitted_without_an_effect_is_weighed_by_its_own_errors(rig, monkeypatch):
    """By those of a fit that ended elsewhere, an output that it missed would count for nothing."""
    problem = pose(rig, *SETS)
    base = problem.base
    lost = replace(base.windows, scale=30.0 * base.windows.scale)
    found = fit_windows(lost, base.unknowns, base.point, 3)
    better = replace(problem, base=found, base_validation=problem.validated(found))
    monkeypatch.setattr(put_back, "improved_base", lambda *asked: better)

    now = put_back._improved(problem, base)

    assert now.base.windows.scale == pytest.approx(base.windows.scale, rel=0.2)
    held_out = now.base_validation.windows.scale
    assert held_out.min() < 2.0 * base.windows.scale.max()


def test_a_final_fit_without_the_bristle_leads_to_one_with_it():
    """Friction that is accepted last is fitted reduced; once it was added it has its bristle."""
    rig = default_rig("crr_rig")
    whole = rig.fit_for(strokes_of_the_rig(rig))
    leaner, full = staged(whole), staged(whole, "friction")
    more = set(full.state_list) - set(leaner.state_list)
    problem, final = begun(rig, full, 0), begun(rig, leaner, 8)

    better = improved_base(problem, [final.base])

    assert more == {"friction.deflection_m"}
    assert better.base.cost < 0.9 * problem.base.cost


def strokes_of_the_rig(rig):
    """Half a second of both ways, the supply drooping."""
    time_s = 1e-3 * np.arange(500)
    channels = {
        "valve.command_v": 5.0 + 1.5 * np.sign(np.sin(2 * np.pi * 4.0 * time_s)),
        "supply.pressure_pa": 6e5 - 2e4 * time_s,
    }
    strong = rig.plant.with_values({"rod.mass_kg": 1.3 * rig.plant.values["rod.mass_kg"]})
    return simulate(strong.lean(), Recording("strokes", 1e-3, channels))


def begun(rig, plant, iterations):
    """A problem whose prior fit made so many steps."""
    recording = strokes_of_the_rig(rig)
    noise = {name: 1e-5 if name == "rod.position_m" else 300.0 for name in recording.channels}
    windows = cut_windows(plant, [recording], noise, 0.1, 5)
    unknowns = nominal_unknowns(plant)
    start = Point(unknowns.scaled(plant.values), windows.start)
    return Problem(rig, plant, (), fit_windows(windows, unknowns, start, iterations), None)


def missing(error, length=200):
    """A fit that misses so much per sample of windows of this length."""
    return SimpleNamespace(error=error, windows=SimpleNamespace(length=length))


@pytest.mark.parametrize(
    ("without", "stays"),
    [((1.3, 1.1), True), ((1.1, 1.3), True), ((1.2, 1.2), False), ((3.0, 0.99), False)],
)
def test_both_errors_are_to_grow_and_one_by_a_quarter(without, stays, monkeypatch):
    monkeypatch.setattr(passing, "per_sample", lambda fit: fit.error)
    kept = Kept((), missing(1.0), missing(1.0))

    assert passing.leaves_more(kept, Kept((), *map(missing, without))) == stays
    assert not passing.leaves_more(kept, Kept((), missing(9.0, 400), missing(9.0, 400)))


def test_no_rival_takes_a_place_with_which_both_errors_grow(rig, monkeypatch):
    """However much more of the model without both it removes."""
    kept = steps_of(rig, SETS, "viscous_friction", "constant_force")
    passes = Passes(rig, *SETS, {"viscous_friction": diagnose(rig, *SETS)}, silent)
    monkeypatch.setattr(passing, "leaves_more", lambda before, after: True)

    tried, same = passes.swaps(kept, kept.steps[0])

    assert tried and not any(each.replaced for each in tried)
    assert any(each.leaves_more for each in tried)
    assert same is kept

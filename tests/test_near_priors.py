"""What rivals leave where nuisances may hardly bend for them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_judgement import BARE, HELD_OUT, TRAIN

from workbench.diagnosis.diagnose import silent
from workbench.diagnosis.follow import follow
from workbench.diagnosis.near_priors import hardly_moving, left_of_both, near_priors
from workbench.diagnosis.ties import tie_group
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.problem import pose
from workbench.fitting.unknowns import nominal_unknowns
from workbench.rig import default_rig, load_rig

AWAY = 3.0  # prior deviations that the best pressure of the surroundings lies off
POWER = 1.0 / 400.0  # of the likelihood
UNSURE = 30.0  # times as wide as the catalogue's: what lies off then shows in the force


@pytest.fixture(scope="module")
def problem():
    return pose(load_rig(BARE), [TRAIN], [HELD_OUT])


@pytest.fixture(scope="module")
def sound(problem):
    found = follow(problem, None, silent).refits
    return next(each for each in found if each.candidate.name == "coulomb_friction")


def believing(rival, deviations):
    """The same refit where the rig believes the surroundings to be so many deviations lower."""
    fit = rival.fit
    known = fit.unknowns.precision >= 1.0
    scale = np.where(known, UNSURE, 1.0) * fit.unknowns.scale
    prior = fit.unknowns.prior - np.where(known, deviations, 0.0) * scale
    unknowns = replace(fit.unknowns, prior=prior, scale=scale)
    return replace(rival, fit=fit_windows(fit.windows, unknowns, fit.point))


def left_near_priors(problem, rival):
    return left_of_both(near_priors(problem, rival))


def test_it_is_the_least_of_a_likelihood_to_a_power_far_below_one(problem, sound):
    """On a bench, which is linear in its parameters, a ridge regression has it in closed form."""
    rival = believing(sound, AWAY)
    fit = rival.fit
    r0, J = fit.derivatives.residual.ravel(), fit.derivatives.parameters.reshape(-1, 2)
    r0 = r0 - J @ fit.point.t
    known = fit.unknowns.precision >= 1.0
    power = POWER / UNSURE**2  # as wide as the catalogue's
    weights = np.sqrt(np.where(known, fit.unknowns.precision / power, fit.unknowns.precision))
    t = np.linalg.lstsq(np.vstack([J, np.diag(weights)]), np.r_[-r0, 0.0, 0.0], rcond=None)[0]
    training = np.sum((r0 + J @ t) ** 2) + np.sum((weights * t) ** 2)
    held_out = problem.validated(replace(fit, point=replace(fit.point, t=t)))

    assert 0.0 < abs(t[0]) < abs(fit.point.t[0]) < AWAY + 0.1
    assert left_near_priors(problem, rival) == pytest.approx(training + held_out.chi2, rel=1e-3)


def test_nuisances_that_bend_cost_though_the_refit_is_as_low(problem, sound):
    """A pressure three deviations off costs nine in a refit, and far more than that here."""
    near, far = believing(sound, 0.0), believing(sound, AWAY)
    more = left_near_priors(problem, far) - left_near_priors(problem, near)

    assert far.fit.cost - near.fit.cost < AWAY**2 + 0.1
    assert more > 5.0 * AWAY**2


def test_what_bends_less_leads_a_tie_though_it_removes_less(problem, sound):
    """By default: nobody has to ask for it."""
    near, far = believing(sound, 0.0), believing(sound, AWAY)
    cause = replace(far.candidate.cause, name="another")
    far = replace(far, candidate=replace(far.candidate, cause=cause), drop_train=0.99)
    near = replace(near, drop_train=0.98)

    assert tie_group(problem, [far, near], {})[0] is near


def test_what_was_added_and_what_is_always_there_is_held_no_closer():
    """The size of a leak has no prior, and a few milliseconds of delay are in every fit."""
    rig = default_rig("servo_drive")
    leak = rig.plant.candidates["piston_leak"]
    free = nominal_unknowns(rig.plant.at_null(leak), added=[leak])
    fit = SimpleNamespace(unknowns=free, windows=SimpleNamespace(plant=rig.plant))
    ratio = dict(zip(free.names, hardly_moving(fit, 0.1).precision / free.precision, strict=True))

    assert ratio[leak.strength] == ratio["command_delay.delay_s"] == 1.0
    assert ratio["slide.mass_kg"] == pytest.approx(100.0)


@pytest.mark.parametrize("factor", [3.0, 10.0])
def test_how_unsure_a_user_is_of_all_parameters_alike_orders_nothing(factor):
    """They are held in the same places then; what one is surer of than the rest stays that."""
    rig = default_rig("servo_drive")
    own = believed(rig)
    own["slide.mass_kg"] *= 0.5
    wide = {name: factor * deviation for name, deviation in own.items()}
    held = [held_to(rig, deviations) for deviations in (own, wide)]

    assert held[0] == pytest.approx(held[1])
    usual = held_to(rig, {})
    assert held[1]["slide.mass_kg"] == pytest.approx(0.5 * usual["slide.mass_kg"])
    assert held[1]["friction.viscous_n_s_m"] == pytest.approx(usual["friction.viscous_n_s_m"])


@pytest.mark.parametrize("narrow", [3, 8, 11, 16])
def test_what_a_rig_knows_well_lets_nothing_else_bend_further(narrow):
    """As a rig does that an earlier fit has written."""
    rig = default_rig("servo_drive")
    own = believed(rig)
    sure = {name: 0.05 * own[name] for name in [*own][:narrow]}

    for name, deviation in held_to(rig, {**own, **sure}).items():
        assert deviation == pytest.approx(0.05 * sure.get(name, own[name]))


def believed(rig):
    """Standard deviations of all that is uncertain, without what is tolerated in every fit."""
    names = nominal_unknowns(rig.plant).names
    known = {name: rig.standard_deviation(name) for name in names}
    return {name: deviation for name, deviation in known.items() if deviation}


def held_to(rig, deviations):
    """Standard deviation that each parameter is held to at a twentieth."""
    free = nominal_unknowns(rig.plant, deviations, fixed=["command_delay.delay_s"])
    fit = SimpleNamespace(unknowns=free, windows=SimpleNamespace(plant=rig.plant))
    found = free.scale / np.sqrt(hardly_moving(fit, 0.05).precision)
    return dict(zip(free.names, found.tolist(), strict=True))


def test_nothing_held_out_counts_nothing(problem, sound):
    alone = replace(problem, base_validation=None)
    least = left_near_priors(alone, sound)

    assert sound.fit.cost <= least < left_near_priors(problem, sound)

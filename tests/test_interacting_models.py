"""Regimes of a plant, and the odds of each: the textbook's formulas, logarithms, and a slide."""

import numpy as np
import pytest

from estimators.interacting_models import PROBABILITY, InteractingModels, combined, mixed
from estimators.regimes import regimes
from workbench.plants.gearbox import COMMANDS, gearbox
from workbench.plants.servo_drive import OUTPUTS, servo_drive
from workbench.plants.soft_joint import soft_joint

T = np.array([[0.9, 0.1], [0.3, 0.7]])


def bank():
    """Two regimes with states of three entries and full covariances."""
    rng = np.random.default_rng(2)
    X, roots = rng.standard_normal((2, 3)), rng.standard_normal((2, 3, 3))
    return X, roots @ roots.transpose(0, 2, 1)


def filterpys(X, P, odds):
    """The same bank in filterpy, whose filters measure the first entry."""
    from filterpy.kalman import IMMEstimator, KalmanFilter

    filters = [KalmanFilter(dim_x=3, dim_z=1) for _ in X]
    for each, x, spread in zip(filters, X, P, strict=True):
        each.x, each.P, each.F, each.H = x[:, None].copy(), spread.copy(), np.eye(3), np.eye(1, 3)
        each.Q, each.R = np.zeros((3, 3)), np.eye(1)
    return IMMEstimator(filters, odds, T)


def test_mixing_equals_the_textbooks_formula():
    """Bar-Shalom, Li and Kirubarajan 2001, Eqs. 11.6.6-7 to 11.6.6-10, summed by hand."""
    X, P = bank()
    odds = np.array([0.2, 0.8])

    means, spreads, foreseen = mixed(X, P, np.log(odds), T)

    for j in (0, 1):
        c = sum(T[i, j] * odds[i] for i in (0, 1))
        share = [T[i, j] * odds[i] / c for i in (0, 1)]
        mean = sum(share[i] * X[i] for i in (0, 1))
        spread = sum(share[i] * (P[i] + np.outer(X[i] - mean, X[i] - mean)) for i in (0, 1))
        assert np.exp(foreseen[j]) == pytest.approx(c)
        assert means[j] == pytest.approx(mean)
        assert spreads[j] == pytest.approx(spread)


def test_a_sample_equals_filterpys_where_likelihoods_are_moderate():
    X, P = bank()
    odds, y = np.array([0.2, 0.8]), np.array([[0.4]])
    other = filterpys(X, P, odds)
    other.predict()
    other.update(y)

    begun, spreads, foreseen = mixed(X, P, np.log(odds), T)
    S = spreads[:, 0, 0] + 1.0
    e = y[0, 0] - begun[:, 0]
    now = begun + (spreads[:, :, 0] / S[:, None]) * e[:, None]
    left = spreads - spreads[:, :, :1] * spreads[:, :1, :] / S[:, None, None]
    log_odds = foreseen - 0.5 * (e**2 / S + np.log(2 * np.pi * S))
    weights = np.exp(log_odds - np.logaddexp.reduce(log_odds))
    mean, spread = combined(now, left, weights)

    assert weights == pytest.approx(other.mu)
    assert mean == pytest.approx(other.x.ravel())
    assert spread == pytest.approx(other.P)


def on_drive(**more):
    noise = dict(zip(OUTPUTS, (5e-6, 500.0, 500.0), strict=True))
    process = {"slide.velocity_m_s": 0.1, **dict.fromkeys(OUTPUTS[1:], 1e3)}
    return InteractingModels(
        plant=servo_drive().lean(),
        measurement_noise=noise,
        process_noise=process,
        **{"sample_time_s": 1e-3} | more,
    )


@pytest.mark.parametrize("sample_time_s", [1e-3, 0.05, 0.4])
def test_switches_are_those_of_a_markov_process_in_time_at_every_sample_time(sample_time_s):
    """A regime is left once in 50 ms on the mean, for either of the others, and may come back."""
    from scipy.linalg import expm

    leaving = (np.full((3, 3), 0.5) - 1.5 * np.eye(3)) / 0.05
    found = on_drive(sample_time_s=sample_time_s).transition

    assert found == pytest.approx(expm(leaving * sample_time_s), rel=1e-9)
    assert (found.diagonal() >= found.max(axis=1) - 1e-12).all()


def test_odds_stay_right_where_likelihoods_are_no_numbers():
    """A position 20 mm off has a likelihood of exp(-8e6), which no product of numbers survives."""
    estimator = on_drive()
    estimate = estimator.start(np.array([0.145, 5.65e5, 5.65e5]))
    for _ in range(20):
        y = np.array([0.145, 5.65e5, 5.65e5])
        estimate = estimator.update(estimate, np.array([4.95]), y)
    estimate = estimator.update(estimate, np.array([4.95]), np.array([0.165, 5.65e5, 5.65e5]))
    odds = [value for name, value in estimate.notes.items() if name.startswith(PROBABILITY)]

    assert sum(odds) == pytest.approx(1.0)
    assert estimate.notes[PROBABILITY + "stick"] < 0.01


def test_a_slide_that_starts_and_stops_is_told_from_one_that_sticks():
    plant = servo_drive().lean()
    step, (_, d, p) = plant.model.compiled_step(1e-3), plant.nominal
    estimator, rng, x, sent = on_drive(), np.random.default_rng(4), plant.initial, np.array([4.95])
    estimate, slides, speed = None, [], []
    for k in range(900):
        y = x[[0, 2, 4]] + rng.standard_normal(3) * [5e-6, 500.0, 500.0]
        estimate = estimate or estimator.start(y)
        estimate = estimator.update(estimate, sent, y)
        slides.append(estimate.notes[PROBABILITY + "stick"] < 0.5)
        speed.append(abs(x[1]))
        sent = np.array([5.6 if 300 <= k < 500 else 4.95])
        x = step(x, sent, d, p).full().ravel()
    slides, speed = np.array(slides), np.array(speed)

    assert not slides[50:300].any()
    assert slides[speed > 0.02].mean() > 0.95


def test_a_slide_that_has_stopped_swings_on_its_bristle():
    """20 ms of swinging at 20 mm/s, which a regime that only holds the slide would miss."""
    plant = servo_drive().lean()
    step, (_, d, p) = plant.model.compiled_step(1e-3), plant.nominal
    estimator, rng, x, sent = on_drive(), np.random.default_rng(4), plant.initial, np.array([4.95])
    estimate, speed, error, sticks = None, [], [], []
    for k in range(700):
        y = x[[0, 2, 4]] + rng.standard_normal(3) * [5e-6, 500.0, 500.0]
        estimate = estimate or estimator.start(y)
        estimate = estimator.update(estimate, sent, y)
        speed.append(x[1])
        error.append(estimate.pick(["slide.velocity_m_s"])[0] - x[1])
        sticks.append(estimate.notes[PROBABILITY + "stick"])
        sent = np.array([5.6 if 100 <= k < 300 else 4.95])
        x = step(x, sent, d, p).full().ravel()
    moving = np.flatnonzero(np.abs(speed) > 0.05)
    after = slice(moving[-1] + 8, moving[-1] + 28)
    speed, error, sticks = map(np.array, (speed, error, sticks))

    assert np.std(speed[after]) > 5e-3
    assert np.std(error[after]) < 0.5 * np.std(speed[after])
    assert np.median(sticks[after]) > 0.9


def test_all_regimes_have_the_same_states_and_other_rates():
    for plant, n in ((servo_drive(), 3), (gearbox(), 4), (soft_joint(), 2)):
        found = regimes(plant)
        models = [regime.model for regime in found.values()]
        x, u = models[0].symbols[0].numel(), plant.nominal[0]

        assert len(found) == n
        assert len({model.states for model in models}) == 1
        moved = [regime.initial + 1e-3 * regime.scale for regime in found.values()]
        rates = [
            model.f(at, u + 0.3, [], plant_p)[0].full().ravel()
            for model, at, plant_p in zip(
                models, moved, [r.nominal[2] for r in found.values()], strict=True
            )
        ]
        assert x == len(rates[0])
        assert not np.allclose(rates[0], rates[1])


def test_a_regime_of_the_gearbox_has_its_valves_where_it_says():
    found = regimes(gearbox())

    assert list(found) == [
        "1 vents 2 vents",
        "1 vents 2 charges",
        "1 charges 2 vents",
        "1 charges 2 charges",
    ]
    regime = found["1 charges 2 vents"]
    rates = regime.model.f(regime.initial, np.zeros(2), [], regime.nominal[2])[0].full().ravel()
    rising = dict(zip(regime.model.states, rates, strict=True))

    assert regime.sent == dict(zip(COMMANDS, (1.0, 0.0), strict=True))
    assert rising["chamber_1.pressure_pa"] > 1e6
    assert abs(rising["chamber_2.pressure_pa"]) < 1e3

"""What is read off a run of an estimator: bands, whiteness, consistency, tuning, prediction."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from linear_plant import cart
from test_estimators import DT_S, FORCE_NOISE, NOISE_M, cart_data, on_cart

from estimators.tuning import own_noise, suited, tuned_noise
from studies.estimator_runs import band, fed, follow, foretold, nees, whiteness
from studies.estimator_truths import counted
from workbench.plants.vertical_cylinder import vertical_cylinder
from workbench.recording import Recording

POSITION, VELOCITY, FORCE = "cart.position_m", "cart.velocity_m_s", "drive.force_n"
N, RUNS = 150, 40


def true_runs():
    """Carts under the noise that their filter believes, from a start it believes."""
    plant, rng = cart(), np.random.default_rng(11)
    step, (_, d, p) = plant.model.step(DT_S), plant.nominal
    for _ in range(RUNS):
        x = np.array([0.0, 0.3 * rng.standard_normal()])
        u, states, seen = rng.normal(0.0, 2.0, N), [], []
        for force in u:
            states.append(x)
            seen.append(x[0] + NOISE_M * rng.standard_normal())
            half = FORCE_NOISE * (DT_S / 2) ** 0.5
            x = x + np.array([0.0, half * rng.standard_normal()])
            kick = np.array([0.0, half * rng.standard_normal()])
            x = step(x, [force], d, p).full().ravel() + kick
        yield u[None], np.array(seen)[None], np.array(states).T


def on_its_start(name="ekf", **more):
    return on_cart(name, initial_deviation={POSITION: NOISE_M, VELOCITY: 0.3}, **more)


@pytest.fixture(scope="module")
def followed():
    estimator = on_its_start()
    return [(follow(estimator, u, y), x) for u, y, x in true_runs()]


def test_a_filter_that_believes_the_truth_is_consistent(followed):
    errors = np.array([nees(run, {POSITION: x[0], VELOCITY: x[1]})[20:] for run, x in followed])
    low, high = band(2, RUNS)
    inside = np.mean((errors.mean(axis=0) > low) & (errors.mean(axis=0) < high))

    assert low < errors.mean() < high
    assert inside > 0.85


def test_one_that_believes_too_little_noise_is_not(followed):
    u, y, x = next(true_runs())
    blind = replace(on_its_start(), process_noise={VELOCITY: 0.05 * FORCE_NOISE})
    found = follow(blind, u, y)

    assert nees(found, {POSITION: x[0], VELOCITY: x[1]})[20:].mean() > band(2, N)[1]


def test_innovations_are_of_unit_size_and_white(followed):
    nis = np.concatenate([run.nis[20:] for run, _ in followed])
    low, high = band(1, len(nis))
    shares = [whiteness(run.innovations[:, 20:])[0] for run, _ in followed]

    assert low < nis.mean() < high
    assert np.mean(shares) < 0.12


def test_innovations_by_foresight_are_those_of_the_filter(followed):
    run, _ = followed[0]

    assert run.nis[5:] == pytest.approx(run.notes["nis"][5:], rel=1e-6)


def test_coloured_innovations_are_told():
    rng = np.random.default_rng(0)
    white = rng.standard_normal(2000)
    coloured = np.convolve(white, np.ones(5), mode="same")

    assert whiteness(white[None])[0] < 0.2
    assert whiteness(coloured[None])[0] >= 0.2
    assert np.isnan(whiteness(np.full((1, 100), np.nan))[0])


def test_the_band_is_that_of_the_textbook():
    """Bar-Shalom, Li and Kirubarajan 2001, Sec. 5.4.2: 50 runs of two degrees, 1.5 to 2.6."""
    assert band(2, 50) == pytest.approx((1.484, 2.591), abs=1e-3)


def test_the_likeliest_process_noise_is_the_true_one():
    rows = [np.concatenate(row, axis=1) for row in zip(*[r[:2] for r in true_runs()], strict=True)]
    starts = tuple(range(0, RUNS * N, N))
    recording = Recording("runs", DT_S, {FORCE: rows[0][0], POSITION: rows[1][0]}, starts=starts)
    start = {POSITION: NOISE_M, VELOCITY: 0.3}
    found = tuned_noise(
        cart(), recording, {POSITION: NOISE_M}, {VELOCITY: 30.0 * FORCE_NOISE}, start
    )

    assert found.process_noise[VELOCITY] == pytest.approx(FORCE_NOISE, rel=0.25)
    assert found.log_likelihood > found.before
    assert list(found.factors) == ["momentum"]


def test_what_is_foretold_is_the_plants_own_run_from_the_estimate():
    u, y = (v.T for v in cart_data(60))
    found = follow(on_its_start(), u, y, 0)
    step, (_, d, p) = cart().model.step(DT_S), cart().nominal
    x = found.states[:, 20]
    for k in range(20, 25):
        x = step(x, u[:, k], d, p).full().ravel()

    errors = foretold(found, cart(), u, y, DT_S, [5], np.array([20]))

    assert errors[5][0] == pytest.approx(abs(y[0, 25] - x[0]), rel=1e-6)


def test_a_horizon_longer_than_the_run_gives_nothing():
    u, y = (v.T for v in cart_data(10))
    found = follow(on_its_start(), u, y, 0)

    assert np.isnan(foretold(found, cart(), u, y, DT_S, [50], np.arange(10))[50]).all()


def test_measured_inputs_are_fed_as_commands():
    plant = vertical_cylinder().lean()
    rows = {name: np.full(5, 2e5) for name in plant.model.measured_inputs}
    recording = Recording("held", 1e-3, {**rows, **{n: np.zeros(5) for n in plant.measured}})
    given, u, y = fed(plant, recording)

    assert given.model.measured_inputs == () and u.shape == (1, 5) and y.shape == (1, 5)


def test_the_first_samples_of_each_phase_are_not_counted():
    mode = np.array([0] * 6 + [1] * 5 + [0] * 2)

    assert (
        counted(mode, 3).tolist()
        == [False] * 3 + [True] * 3 + [False] * 3 + [True] * 2 + [False] * 2
    )


@dataclass(frozen=True)
class Failing:
    """A filter whose matrices cannot be factorised from some sample on, or that becomes NaN."""

    inner: object
    error: Exception | None

    @property
    def plant(self):
        return self.inner.plant

    def start(self, measurement):
        return self.inner.start(measurement)

    def update(self, last, command, measurement):
        if self.error:
            raise self.error
        return replace(last, state=np.full(2, np.nan))


@pytest.mark.parametrize("error", [RuntimeError("Linsol failed"), None])
def test_an_estimator_that_is_lost_says_where(error):
    with pytest.raises(ArithmeticError, match="lost at sample 0"):
        follow(Failing(on_its_start(), error), np.zeros((1, 5)), np.zeros((1, 5)), 0)


def test_an_estimate_that_no_plant_can_come_to_is_lost_too():
    begun = on_its_start()

    class RunsAway:
        plant = begun.plant

        def start(self, measurement):
            return begun.start(measurement)

        def update(self, last, command, measurement):
            return replace(last, state=last.state + np.array([4e5, 0.0]))

    with pytest.raises(ArithmeticError, match=r"position is 4e\+08 mm"):
        follow(RunsAway(), np.zeros((1, 5)), np.zeros((1, 5)), 0)


@pytest.mark.parametrize("name", ["kalman", "imm"])
def test_the_noise_of_ones_own_innovations_is_that_which_drove_the_plant(name):
    """From a thirtieth of it on; on a linear plant both are the Kalman filter."""
    u, y = cart_data(300)
    begun = replace(on_cart(name), process_noise={VELOCITY: FORCE_NOISE / 30.0})

    found = own_noise(begun, u.T, y.T)
    fitted = suited(begun, u.T, y.T)

    assert found.process_noise[VELOCITY] == pytest.approx(FORCE_NOISE, rel=0.4)
    assert found.log_likelihood > found.before + 100.0
    assert fitted.process_noise == found.process_noise
    assert suited(on_cart("ekf"), u.T, y.T).process_noise == {VELOCITY: FORCE_NOISE}

"""The Kalman filters against closed forms and other programs; late, missing and wrong samples."""

from itertools import product

import numpy as np
import pytest
from linear_plant import cart
from scipy.linalg import expm, solve_discrete_are
from test_estimators import DT_S, cart_data, on_cart, run

from estimators import ESTIMATORS
from estimators.ahead import Ahead, in_time
from estimators.gated import Gated
from estimators.late import Late
from estimators.scheduled_kalman import noise_of_modes, standard_bank
from workbench.filtering import consistent_start
from workbench.plant import Plant
from workbench.plants import PLANTS
from workbench.plants.servo_drive import OUTPUTS, servo_drive

VELOCITY = "slide.velocity_m_s"
SLIDING_NOISE = {VELOCITY: 0.1, **dict.fromkeys(OUTPUTS[1:], 1e3)}
SENSORS = dict(zip(OUTPUTS, (5e-6, 500.0, 500.0), strict=True))


def on_drive(name, plant=None, **more):
    settings = dict(measurement_noise=SENSORS, process_noise=SLIDING_NOISE) | more
    return ESTIMATORS[name](plant=plant or servo_drive().lean(), sample_time_s=1e-3, **settings)


@pytest.fixture
def uncompiled(monkeypatch):
    """No time for the compiler: functions run in CasADi's virtual machine."""
    monkeypatch.setenv("WORKBENCH_NO_COMPILER", "1")


def test_the_extended_filter_equals_filterpys_with_its_own_jacobians():
    from filterpy.kalman import ExtendedKalmanFilter

    ours = on_drive("ekf")
    plant, filter_ = ours.plant, ours.filter
    model, (_, d, p), size = plant.model, plant.nominal, plant.scale
    x = consistent_start(plant, {"slide.position_m": 0.1, VELOCITY: 0.2})
    u, y = np.array([5.6]), np.array([0.1003, 5.7e5, 5.6e5])
    P = np.diag(np.square([1e-4, 1e-2, 0.02, 0.02, 0.02, 0.02, 0.0]))
    A = model.jacobians(x, u, d, p)[0].full() * size / size[:, None]
    F, Q = expm(A * 1e-3), filter_.step_covariance
    other = ExtendedKalmanFilter(dim_x=7, dim_z=3)
    size_y = np.array([*SENSORS.values()])
    other.x = (model.step(1e-3)(x, u, d, p).full().ravel() / size)[:, None]
    other.P = F @ (P + Q / 2) @ F.T + Q / 2
    other.P[6], other.P[:, 6] = 0.0, 0.0  # a bristle is not corrected
    C = model.jacobians(x, u, d, p)[2].full() * size / size_y[:, None]
    other.R = np.eye(3)
    other.update((y / size_y)[:, None], lambda _: C, lambda z: C @ z)
    found = ours.sample(x / size, P, u, y, np.ones(3))

    assert found.X[:6] == pytest.approx(other.x.ravel()[:6], rel=1e-4)
    spread = np.sqrt(np.diag(other.P)[:6])
    off = (found.P - other.P)[:6, :6] / np.outer(spread, spread)
    assert np.abs(off).max() < 1e-4
    assert found.log_likelihood == pytest.approx(
        other.log_likelihood - np.log(size_y).sum(), rel=1e-4
    )


def test_a_mode_that_lasts_comes_to_the_gain_of_its_riccati_equation():
    import control

    plant = servo_drive().lean()
    name = "charge a slide + middle"
    kalman = on_drive("kalman", mode=name)
    hybrid = standard_bank(plant)
    estimate = kalman.start(hybrid[name].output)
    for _ in range(3000):
        estimate = kalman.update(estimate, np.array([5.6]), np.full(3, 0.0) + hybrid[name].output)
    size = hybrid.model.scale
    index = [mode.name for mode in hybrid.modes].index(name)
    F = kalman.sampled.steps[index][:, :4] * size / size[:, None]
    noise = np.array([SLIDING_NOISE.get(n, 0.0) for n in hybrid.model.states]) / size
    Q = np.diag(noise**2) * 1e-3
    Q = F @ Q @ F.T / 2 + Q / 2
    C, R = hybrid[name].C * size, np.diag(np.square(list(SENSORS.values())))
    ahead = solve_discrete_are(F.T, C.T, Q, R)
    K = ahead @ C.T @ np.linalg.inv(C @ ahead @ C.T + R)
    by_control = control.dlqe(F, np.eye(4), C, Q, R)[1]

    assert by_control == pytest.approx(ahead, rel=1e-6)
    assert estimate.memory == pytest.approx(ahead - K @ C @ ahead, rel=1e-6, abs=1e-14)


@pytest.mark.parametrize("name", ["ekf", "kalman", "imm"])
def test_an_estimator_with_other_noise_is_the_one_that_is_made_with_it(name, uncompiled):
    more = {VELOCITY: 0.5, **dict.fromkeys(OUTPUTS[1:], 2e4)}
    fresh, retuned = on_drive(name, process_noise=more), on_drive(name).retuned(more)
    y, u, off = np.array([0.145, 5.65e5, 5.65e5]), np.array([5.4]), np.array([1e-5, 1e3, 1e3])

    one, other = (each.update(each.start(y), u, y + off) for each in (fresh, retuned))

    assert retuned.process_noise == more
    assert other.state == pytest.approx(one.state, rel=1e-12)
    assert other.covariance == pytest.approx(one.covariance, rel=1e-9, abs=1e-30)
    assert other.notes["log-likelihood"] == pytest.approx(one.notes["log-likelihood"])


def test_the_likelihood_of_the_linear_filter_is_that_of_the_extended_one_on_a_linear_plant():
    u, y = cart_data(30)
    last = [run(on_cart(name), u, y)[-1].notes for name in ("kalman", "ekf")]

    assert last[0]["log-likelihood"] == pytest.approx(last[1]["log-likelihood"], rel=1e-6)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_every_estimator_tells_how_surprising_a_sample_is(name):
    """So that a gate need not ask for it by a second update."""
    u, y = cart_data(30)
    found, known = (run(on_cart(each), u, y)[-1].notes["nis"] for each in (name, "ekf"))

    assert found == pytest.approx(known, rel=1e-5)


@pytest.mark.parametrize(("place_m", "on"), [(12.05e-3, (1.0, 0.0)), (-12.05e-3, (0.0, 1.0)),
                                             (0.0, (1.0, 1.0))])  # fmt: skip
def test_a_piston_that_contacts_hold_is_not_taken_to_move(place_m, on):
    """Pressed against an end by 5 bar, or held at Neutral from both sides."""
    plant = PLANTS["gearbox"]().lean()
    noise = {"main_piston.velocity_m_s": 5.0, "main_piston.position_m": 0.0}
    noise |= dict.fromkeys(plant.measured[:2], 3e5)
    sizes = [5e-5 if name.endswith("_m") else 1e3 for name in plant.measured]
    kalman = on_drive("kalman", plant, process_noise=noise,
                      measurement_noise=dict(zip(plant.measured, sizes, strict=True)))  # fmt: skip
    known = {"main_piston.position_m": place_m}
    known |= {n: 1e5 + 4e5 * v for n, v in zip(plant.measured[:2], on, strict=True)}
    y, rng = np.array([known[n] for n in plant.measured]), np.random.default_rng(1)
    estimate, speeds = kalman.start(y), []
    for _ in range(60):
        estimate = kalman.update(estimate, np.array(on), y + sizes * rng.standard_normal(3))
        speeds.append(abs(estimate.pick(["main_piston.velocity_m_s"])[0]))

    assert max(speeds) < 0.05


def test_the_scheduled_filter_follows_the_drive_through_its_modes():
    plant = servo_drive().lean()
    step, (_, d, p) = plant.model.compiled_step(1e-3), plant.nominal
    curved = noise_of_modes(plant, {VELOCITY: 0.1, "friction.deflection_m": 1e-6})
    kalman, rng = on_drive("kalman", process_noise=curved), np.random.default_rng(5)
    estimate, modes, errors, sent, x, speed = None, set(), [], plant.nominal[0], plant.initial, []
    for k in range(1500):
        y = x[[0, 2, 4]] + rng.standard_normal(3) * list(SENSORS.values())
        u = np.array([4.95 + 0.9 * np.sin(4.0 * k * 1e-3)])
        estimate = estimate or kalman.start(y)
        estimate = kalman.update(estimate, sent, y)
        modes.add(estimate.notes["mode"])
        errors.append(estimate.pick([VELOCITY])[0] - x[1])
        speed.append(x[1])
        x, sent = step(x, u, d, p).full().ravel(), u

    assert (curved[VELOCITY], curved[OUTPUTS[1]]) == (2.0, 1e5)
    assert curved["friction.deflection_m"] == 1e-6
    assert len(modes) >= 4
    assert np.std(errors) < 0.1 * np.std(speed)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_a_late_output_says_what_it_would_have_said_in_time_carried_on(name):
    late = 3
    u, y = cart_data(40)
    arrived = np.vstack([np.full((late, 1), np.nan), y[:-late]])
    in_time = run(on_cart(name), u, y)
    found = run(Late(inner=on_cart(name), samples={"cart.position_m": late}), u, arrived)
    step, (_, d, p) = cart().model.step(DT_S), cart().nominal
    # both start at y[0], the late one from a guess before it
    x = in_time[-1 - late].state
    for command in u[len(u) - 1 - late : len(u) - 1]:
        x = step(x, command, d, p).full().ravel()

    assert found[-1].state == pytest.approx(x, rel=2e-3, abs=2e-6)


def test_the_name_of_a_late_output_must_be_known():
    with pytest.raises(ValueError, match="late outputs need whole samples"):
        Late(inner=on_cart("ekf"), samples={"nothing": 2})


@pytest.mark.parametrize("name", ESTIMATORS)
def test_an_outlier_is_left_out_and_all_else_is_not(name):
    u, y = cart_data(60)
    wrong = y.copy()
    wrong[40] += 0.05
    gated = run(Gated(inner=on_cart(name)), u, wrong)
    y[40] = np.nan
    without = run(on_cart(name), u, y)

    assert sum(estimate.notes["outliers"] for estimate in gated) == 1.0
    assert gated[40].notes["outliers"] == 1.0
    assert gated[-1].state == pytest.approx(without[-1].state, rel=1e-9)


def test_of_several_outputs_the_wrong_one_is_left_out():
    u = np.tile(servo_drive().nominal[0], (30, 1))
    y = [0.145, 5.65e5, 5.65e5] + [*SENSORS.values()] * np.random.default_rng(2).normal(
        size=(30, 3)
    )
    wrong = y.copy()
    wrong[20, 1] += 5e4
    y[20, 1] = np.nan
    gated, without = run(Gated(inner=on_drive("ekf")), u, wrong), run(on_drive("ekf"), u, y)

    assert [e.notes["outliers"] for e in gated[1:]] == [float(k == 20) for k in range(1, 30)]
    assert np.array_equal(gated[-1].state, without[-1].state)


def test_a_sensor_that_jumped_for_good_is_believed_after_a_while():
    u, y = cart_data(80)
    y[30:] += 2.0
    gated = run(Gated(inner=on_cart("ekf"), patience=10), u, y)
    outliers = [estimate.notes["outliers"] for estimate in gated]

    assert outliers[30:40] == [1.0] * 10
    assert outliers[40] == 0.0
    assert abs(gated[40].state[0] - y[40, 0]) < 0.5 * abs(gated[39].state[0] - y[39, 0])


@pytest.mark.parametrize("name", ESTIMATORS)
def test_sensors_of_several_rates_need_no_more_than_holes(name):
    plant = servo_drive().lean()
    step, (_, d, p) = plant.model.compiled_step(1e-3), plant.nominal
    estimator, rng, x, u = on_drive(name), np.random.default_rng(5), plant.initial, np.array([5.6])
    estimate, velocity = None, []
    for k in range(150):
        y = x[[0, 2, 4]] + rng.standard_normal(3) * list(SENSORS.values())
        y[0] = np.nan if k % 5 else y[0]
        estimate = estimate or estimator.start(y)
        estimate = estimator.update(estimate, u, y)
        velocity.append(estimate.pick([VELOCITY])[0] - x[1])
        x = step(x, u, d, p).full().ravel()

    assert x[1] > 0.1
    assert np.abs(velocity[60:]).max() < 0.05


WITH_STATES = [name for name, build in PLANTS.items() if build().state_list]


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        *product(WITH_STATES, ("ekf",)),
        ("closed_chamber", "kalman"),
        ("vertical_cylinder", "kalman"),
    ],
)
def test_every_plant_has_a_filter_for_each_of_its_sensors(name, kind, uncompiled):
    """Modes, too, where nothing supplies the gas and where there are no standard ones."""
    plant = PLANTS[name]().lean().with_inputs_commanded()
    rest = plant.model.h(plant.initial, *plant.nominal).full().ravel()
    for k, output in enumerate(plant.measured):
        single = plant.with_measured(output)
        estimator = ESTIMATORS[kind](
            plant=single,
            sample_time_s=1e-3,
            measurement_noise={output: 1e-3 * max(abs(rest[k]), 1.0)},
            process_noise=dict(zip(plant.model.states, 1e-3 * plant.scale, strict=True)),
            initial_deviation=dict(zip(plant.model.states, 1e-3 * plant.scale, strict=True)),
        )
        estimate = estimator.start(rest[[k]])
        for y in (rest[[k]], np.full(1, np.nan), rest[[k]]):
            estimate = estimator.update(estimate, single.nominal[0], y)

        assert np.isfinite(estimate.state).all() and np.isfinite(estimate.covariance).all()
        assert estimate.notes["nis"] < 20.0


def test_a_measured_input_among_the_commands_drives_the_same_plant():
    plant = servo_drive().lean().with_measured_input("supply.pressure_pa")
    fed = plant.with_inputs_commanded()
    u, d, p = plant.nominal
    apart = plant.model.f(plant.initial, u, 0.9 * d, p)[0].full()
    together = fed.model.f(plant.initial, [*u, *(0.9 * d)], [], p)[0].full()

    assert np.array_equal(apart, together)
    assert isinstance(fed, Plant) and fed.model.commands[-1] == "supply.pressure_pa"


@pytest.mark.parametrize("name", ["kalman", "imm"])
def test_an_estimate_of_fewer_states_is_carried_over_a_delay_too(name):
    late = servo_drive().with_values({"command_delay.delay_s": 3e-3}).lean()
    plant = servo_drive().lean()
    bare, ahead = on_drive(name), in_time(on_drive(name, late), late)
    y = np.array([0.145, 5.65e5, 5.65e5])
    now, carried = bare.start(y), ahead.start(y)
    for _ in range(5):
        now = bare.update(now, plant.nominal[0], y)
        carried = ahead.update(carried, plant.nominal[0], y)

    assert isinstance(ahead, Ahead) and carried.names == now.names
    assert carried.pick(OUTPUTS) == pytest.approx(now.pick(OUTPUTS), rel=1e-3)

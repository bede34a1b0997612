"""What study ``soft-joint-mhe`` does with its records, on short ones."""

import numpy as np
import pytest

import studies.soft_joint_fits as soft_joint_fits
from estimators.losses import Huber
from studies.paper_004 import PAPER, settings
from studies.soft_joint_fits import (
    C_BOUNDS,
    KAPPA_BOUNDS,
    PSI_PA,
    SAMPLE_TIME_S,
    TAU,
    Data,
    FreeRun,
    first_principles,
    fitted_tau,
    parametric,
    recorded,
    several_starts,
    values_of,
)
from studies.soft_joint_horizon import (
    Setting,
    ahead,
    edges,
    free_run,
    lags,
    needed,
    tracked,
    worth,
)
from studies.study import Extent
from studies.truth.soft_joint_event import (
    EVENT_COMMAND,
    EVENT_S,
    SHORTEST_S,
    STUCK_SHARE,
    EventRecord,
    event_command,
    event_records,
)
from workbench.plants.soft_joint import COMMAND, PRESSURE
from workbench.recording import Recording
from workbench.simulation import simulate


def record_of(plant, u, first_pa=1.5e5, noise_pa=0.0):
    """A record of a model itself, for what must come back exactly."""
    x0 = plant.initial
    x0[plant.model.states.index(PRESSURE)] = first_pa
    run = simulate(plant, Recording("own", SAMPLE_TIME_S, {COMMAND: u}), x0)
    noise = noise_pa * np.random.default_rng(1).standard_normal(len(u))
    return Recording("own", SAMPLE_TIME_S, {COMMAND: u, PRESSURE: run[PRESSURE] + noise})


def steps(levels=(0.57, 0.5, 0.43, 0.56, 0.44, 0.5), held_s=0.5):
    return np.repeat(levels, round(held_s / SAMPLE_TIME_S))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_record_steps_where_the_spool_moves_and_the_event_where_it_sticks(seed):
    command, (first, last) = event_command(30.0, np.random.default_rng(seed))
    stuck = (command < 0.48) & (command >= 0.48 - STUCK_SHARE)

    assert len(command) == 12_000 and last - first == EVENT_S / SAMPLE_TIME_S
    assert (command[first:last] == EVENT_COMMAND).all()
    assert stuck[first:last].all() and stuck.sum() == last - first
    assert np.flatnonzero(np.diff(command)).size > 20


def test_the_shortest_record_has_room_for_all_parts():
    command, (first, last) = event_command(SHORTEST_S, np.random.default_rng(1))

    assert len(command) == SHORTEST_S / SAMPLE_TIME_S and 0 < first < last < len(command)


@pytest.mark.slow
def test_the_true_bellows_does_not_vent_in_the_event():
    (made,) = event_records(SHORTEST_S, [1])
    first, last = made.event
    pressure = 1e5 * made.table["pressure_bar"]

    assert np.ptp(pressure[first:last]) < 10.0 * 1e3
    assert pressure[first] > 5e5


def test_a_record_too_short_for_its_event_is_refused():
    with pytest.raises(ValueError, match="a record of 12 s is too short, expected 25 s or more"):
        event_command(12.0, np.random.default_rng(0))


def test_records_are_kept_and_read_back(tmp_path, monkeypatch):
    def made(duration_s, seeds):
        n = round(duration_s / SAMPLE_TIME_S)
        columns = ("time_s", "command", "pressure_bar", "supply_bar")
        return [EventRecord({c: np.full(n, float(k)) for c in columns}, (5, 9)) for k in seeds]

    monkeypatch.setattr(soft_joint_fits, "event_records", made)
    first = recorded(3.0, tmp_path / "records.npz")
    monkeypatch.setattr(soft_joint_fits, "event_records", None)  # not called again
    again = recorded(3.0, tmp_path / "records.npz")

    assert again.event == first.event == (5, 9)
    assert again.judged[PRESSURE] == pytest.approx(3e5) and len(again.judged) == 1200
    assert again.training[PRESSURE] == pytest.approx(1e5) and len(again.training) == 12_000
    assert again.nominal.sum() == 5  # the mark of the event outlasts the record


def test_the_coefficients_are_those_of_filling_and_of_venting():
    plant = first_principles().with_values(values_of(1.4, 0.8, 0.5))

    mean, share = (plant.values[f"valve.discharge_{n}"] for n in ("coefficient", "asymmetry"))
    assert mean * (1.0 + share) == pytest.approx(0.8) and mean * (1.0 - share) == pytest.approx(0.5)


def test_a_search_finds_the_coefficients_of_a_record_of_the_model_itself():
    """With kappa free they do so along the valley that the study shows: their ratio is found."""
    plant = first_principles()
    truth = values_of(1.4, 0.8, 0.5)
    own = record_of(plant.with_values(truth), steps())

    (found,) = several_starts(plant, own, "SLSQP", 1)

    kappa, filling, venting = found.end
    assert KAPPA_BOUNDS[0] <= kappa <= KAPPA_BOUNDS[1]
    assert C_BOUNDS[0] <= filling <= C_BOUNDS[1]
    assert found.rmse_psi < 0.05
    assert filling / venting == pytest.approx(1.6, rel=0.03)


def test_without_the_molar_mass_the_same_flows_take_34_times_as_long():
    ratio = 0.99 / 0.029
    u = np.full(4000, 0.6)
    slow, fast = (FreeRun(first_principles(p), record_of(first_principles(), u)) for p in (1, 0))

    reached = fast()[40]
    assert slow()[round(40 * ratio)] == pytest.approx(reached, rel=1e-2)


def test_one_time_constant_comes_back_from_a_record_of_the_model_itself():
    own = record_of(parametric().with_values({TAU: 0.083}), steps())

    assert fitted_tau(parametric(), own) == pytest.approx(0.083, rel=1e-3)


@pytest.fixture(scope="module")
def tracked_jump():
    """A record of the model whose time constant jumps in the middle, and its horizon's estimate."""
    u = steps((0.57, 0.44) * 6)
    n = len(u)
    taus = np.where(np.arange(n) < n // 2, 0.05, 0.09)
    blank = Recording("blank", SAMPLE_TIME_S, {COMMAND: u, PRESSURE: np.full(n, 1.5e5)})
    pressure = free_run(parametric(), blank, taus)
    noisy = pressure + 1e3 * np.random.default_rng(2).standard_normal(n)
    record = Recording("jump", SAMPLE_TIME_S, {COMMAND: u, PRESSURE: noisy})
    data = Data(record, record, (n // 2, n))
    setting = Setting(horizon=100)
    return data, taus, *tracked(parametric(), record, setting)


def test_a_horizon_follows_a_time_constant_that_jumps(tracked_jump):
    _, taus, found, lost = tracked_jump
    late = np.r_[200 : len(taus) // 2, len(taus) // 2 + 200 : len(taus)]

    assert lost == 0
    assert np.median(np.abs(found[late] / taus[late] - 1.0)) < 0.03


def test_its_estimate_makes_a_free_run_and_predictions_better(tracked_jump):
    data, taus, found, _ = tracked_jump
    plant = parametric()
    fixed, own = (worth(plant, data, t) for t in (np.full(len(taus), 0.05), found))
    ends, errors = ahead(plant, data.judged, taus)

    assert own.event_psi < 0.7 * fixed.event_psi
    assert own.event_rmse_psi < 0.7 * fixed.event_rmse_psi
    assert own.ahead_event_psi < 0.7 * fixed.ahead_event_psi
    one = (ends <= len(taus) // 2) | (ends - 400 >= len(taus) // 2)  # time constant all the way
    assert np.sqrt(np.mean(errors[one] ** 2)) < 3.0 * 1e3 and ends[0] == 400


def test_a_shift_in_time_is_found_as_lag():
    u = steps((0.57, 0.44) * 8, 1.5)
    n = len(u)
    record = Recording("edges", SAMPLE_TIME_S, {COMMAND: u, PRESSURE: np.full(n, 3e5)})
    data = Data(record, record, (n, n))
    wanted = 0.05 + 0.02 * np.sin(np.arange(n) / 90.0)
    late = np.roll(wanted, 80)

    assert lags(data, late, wanted) == pytest.approx({"rising": 0.2, "falling": 0.2}, abs=0.02)
    assert {kind: len(at) for kind, at in edges(record).items()} == {"rising": 7, "falling": 8}


def test_what_is_needed_is_the_time_constant_itself_where_the_models_agree():
    plant, slower = parametric(), parametric().with_values({TAU: 0.1})
    own = record_of(slower, steps())

    wanted = needed(plant, slower, own)

    assert np.nanmin(wanted) == pytest.approx(0.1) and np.nanmax(wanted) == pytest.approx(0.1)
    assert np.isnan(wanted).any()


def test_the_grid_holds_every_knob_once():
    for extent in Extent:
        every = settings(extent)

        assert len({s.name for s in every}) == len(every) and PAPER in every
        assert any(s.loss == Huber() for s in every)
        assert len({s.horizon for s in every}) > 1 and len({s.movement_s for s in every}) > 1
        assert len({s.bounds_s for s in every}) == 2
    assert pytest.approx(6894.757) == PSI_PA

"""A closed chamber against a flat oracle, and the two chambers that were really recorded."""

import numpy as np
import oracle_closed_chamber as oracle
import pytest
from scipy.optimize import least_squares

from workbench.plants import PLANTS
from workbench.recording import Recording
from workbench.recordings import chamber_decay, real_data_folder
from workbench.simulation import simulate

DATA = real_data_folder()
with_data = pytest.mark.skipif(
    DATA is None, reason="the real recordings are not here: set WORKBENCH_DATA to their folder"
)
PRESSURE = "chamber.pressure_pa"
LEAK, HEAT = "chamber_leak.area_m2", "wall_heat.coefficient_w_m2_k"
WALL, WALL_TIME = "wall_heat.heating_k_j", "wall_heat.wall_time_s"
ROOM_K = 293.15


@pytest.fixture(scope="module")
def chamber():
    return PLANTS["closed_chamber"]()


def start(pressure_pa, temperature_k=ROOM_K):
    return np.array([pressure_pa, pressure_pa * oracle.V / (oracle.R * temperature_k), 0.0])


def still(n, dt=0.1):
    """A recording of nothing but time."""
    return Recording("still", dt, {PRESSURE: np.full(n, np.nan)})


def run(plant, initial, n, dt=0.1):
    return simulate(plant, still(n, dt), initial)


def test_the_composed_chamber_has_the_rates_of_the_flat_one(chamber):
    rng = np.random.default_rng(6)
    for _ in range(100):
        p, temperature = rng.uniform(0.8e5, 9e5), rng.uniform(250, 350)
        x = start(p, temperature) + np.array([0.0, 0.0, rng.normal(0, 5)])
        area, coefficient = rng.uniform(0, 3e-7), rng.uniform(0, 100)
        values = {LEAK: area, HEAT: coefficient, WALL: 0.05, WALL_TIME: 60.0}
        parameters = chamber.with_values(values).nominal[2]
        ours = chamber.model.f(x, [], [], parameters)[0].full().ravel()
        size = np.array([1e5, 1e-4, 10.0])

        np.testing.assert_allclose(
            ours / size, oracle.rates(x, area, coefficient, 0.05, 60.0) / size, 1e-10, 1e-10
        )


def test_the_bare_chamber_stands_still(chamber):
    pressure_pa = run(chamber, start(8e5, 320.0), 1400)[PRESSURE]

    assert (pressure_pa == 8e5).all()


def test_a_leak_empties_the_chamber_to_ambient_and_no_further(chamber):
    plant = chamber.with_values({LEAK: 3e-7, HEAT: 20.0})
    pressure_pa = run(plant, start(8e5), 3000)[PRESSURE]

    assert (np.diff(pressure_pa) < 1.0).all()
    assert pressure_pa[-1] == pytest.approx(1.013e5, rel=1e-3)


def test_a_chamber_that_cools_keeps_its_mass_and_ends_at_the_temperature_of_its_wall(chamber):
    plant = chamber.with_values({HEAT: 20.0})
    result = run(plant, start(8e5, 313.15), 1400)

    assert result["chamber.mass_kg"][-1] == result["chamber.mass_kg"][0]
    assert result[PRESSURE][-1] == pytest.approx(8e5 * ROOM_K / 313.15, rel=1e-4)


def test_gas_and_wall_keep_their_energy_where_nothing_goes_to_ambient(chamber):
    plant = chamber.with_values({HEAT: 20.0, WALL: 0.05, WALL_TIME: 1e4})
    result = run(plant, start(8e5, 313.15), 600)
    stored_j = result["wall_heat.stored_j"]
    energy_j = result[PRESSURE] * oracle.V / (oracle.K - 1) + stored_j
    lost_j = np.trapezoid(stored_j, dx=0.1) / 1e4

    assert stored_j.max() > 1.0
    assert energy_j[-1] + lost_j == pytest.approx(energy_j[0], rel=1e-6)


def test_a_wall_that_warms_up_holds_the_pressure_longer(chamber):
    cold, warm = (
        run(chamber.with_values({HEAT: 20.0, WALL: heating}), start(8e5, 313.15), 100)[PRESSURE][-1]
        for heating in (0.0, 0.05)
    )

    assert warm > cold + 500.0


def rms(errors):
    return np.sqrt(np.mean(errors**2))


def errors_mbar(plant, train, rest, guess, warmer_k=None):
    """Errors in mbar on the first 60 % and the rest, start pressure and ``guess`` fitted.

    With ``warmer_k`` the gas starts that much above ambient, and by how much is fitted too.
    """
    recorded = np.concatenate([train[PRESSURE], rest[PRESSURE]])
    n, dt, model = len(train), train.sample_time_s, plant.model
    starts = [recorded[0]] if warmer_k is None else [recorded[0], warmer_k]
    size = np.array([*starts, *guess.values()])

    def errors(scale):
        p0, *values = scale * size
        warmer = values.pop(0) if warmer_k else 0.0
        changed = plant.with_values(dict(zip(guess, values, strict=True)))
        changed.__dict__["model"] = model  # the expressions do not depend on the values
        initial = start(p0, ROOM_K + warmer)[: len(plant.initial)]
        return (run(changed, initial, len(recorded), dt)[PRESSURE] - recorded) / 100.0

    ones, bounds = np.ones(len(size)), (0.0, np.inf)
    options = dict(diff_step=1e-4, bounds=bounds, xtol=1e-4, max_nfev=20)
    found = least_squares(lambda s: errors(s)[:n], ones, **options)
    off = errors(found.x)
    return off[:n], off[n:]


@with_data
@pytest.mark.parametrize(
    ("name", "constant_mbar", "leak_mbar"),
    [("Aluminium", 18.8, 4.1), ("Ultimaker_006", 27.2, 3.5)],
)
def test_a_leak_predicts_the_decay_that_a_constant_does_not(name, constant_mbar, leak_mbar):
    """Errors on the last 40 %, those of the data set's README.

    There the leak of the aluminium chamber has 3.3 mbar; least squares of start pressure and area
    on the first 60 % gives 4.1, with or without the seconds before the clock stumbles.
    """
    train, rest = chamber_decay.recordings(DATA, name)
    plant = chamber_decay.rig().plant

    flat = errors_mbar(plant.lean(), train, rest, {})[1]
    leaking = errors_mbar(plant.lean(keep=["chamber_leak"]), train, rest, {LEAK: 1e-10})[1]

    assert rms(flat) == pytest.approx(constant_mbar, rel=0.04)
    assert rms(leaking) == pytest.approx(leak_mbar, rel=0.1)


@with_data
def test_the_mean_size_of_the_aluminium_chambers_error_is_within_the_3_3_mbar_of_its_readme():
    """It may be what that README gives there, in place of the root mean square, which is 4.1."""
    plant = chamber_decay.rig().plant.lean(keep=["chamber_leak"])
    leaking = errors_mbar(plant, *chamber_decay.recordings(DATA, "Aluminium"), {LEAK: 1e-10})[1]

    assert 3.1 < np.mean(np.abs(leaking)) < 3.3


@with_data
@pytest.mark.parametrize("name", chamber_decay.CHAMBERS)
def test_within_140_seconds_cooling_explains_the_decay_as_well_as_a_leak(name):
    train, rest = chamber_decay.recordings(DATA, name)
    plant = chamber_decay.rig().plant

    leaking = errors_mbar(plant.lean(keep=["chamber_leak"]), train, rest, {LEAK: 1e-10})
    cooling = errors_mbar(plant.lean(keep=["wall_heat"]), train, rest, {HEAT: 0.03}, warmer_k=5.0)

    assert rms(cooling[0]) == pytest.approx(rms(leaking[0]), rel=0.05)
    assert rms(cooling[1]) < 1.5 * rms(leaking[1])

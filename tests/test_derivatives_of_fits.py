"""Derivatives that fits share: borrowed from a plant with fewer states, corrected by a step."""

import numpy as np
import pytest

from workbench.fitting.linearised import Point, borrowed, linearise, plant_at, secant
from workbench.fitting.unknowns import Unknowns
from workbench.fitting.windows import cut_windows
from workbench.plants import servo_drive
from workbench.recording import Recording
from workbench.simulation import simulate

NOISE = {"slide.position_m": 5e-6, "chamber_a.pressure_pa": 500.0, "chamber_b.pressure_pa": 500.0}
LAG = "valve_lag.time_constant_s"
MASS, COULOMB = "slide.mass_kg", "friction.coulomb_force_n"


def unknowns_of(**scales):
    """Unknowns around 2.22 kg, 42 N and 4 ms."""
    prior = {MASS: 2.22, COULOMB: 42.0, LAG: 4e-3}
    names = tuple({"mass": MASS, "coulomb": COULOMB, "lag": LAG}[key] for key in scales)
    rows = [np.array([prior[n] for n in names]), np.array(list(scales.values()))]
    n = len(names)
    return Unknowns(names, *rows, np.zeros(n), np.full(n, 1e9), np.ones(n))


KNOWN = unknowns_of(mass=0.05, coulomb=2.0)


@pytest.fixture(scope="module")
def recording():
    time_s = 1e-3 * np.arange(1000)
    u = 4.95 + 0.9 * np.sin(2 * np.pi * 1.1 * time_s) + 0.3 * np.sin(2 * np.pi * 2.7 * time_s)
    plant = servo_drive().with_values({LAG: 4e-3}).lean()
    run = simulate(plant, Recording("sines", 1e-3, {"valve.command_v": u}))
    return Recording("sines", 1e-3, {"valve.command_v": u, **{n: run[n] for n in NOISE}})


@pytest.fixture(scope="module")
def windows(recording):
    return cut_windows(servo_drive().lean(), [recording], NOISE)


def derivatives(at):
    """All derivatives of the recorded rows, (n_windows, rows, n_x + n_p)."""
    n_x = at.triangle.shape[1]
    both = np.concatenate([at.basis @ at.triangle, at.parameters], axis=2)
    return both[:, : both.shape[1] - n_x]


def test_after_a_step_the_corrected_derivatives_give_what_it_changed(windows):
    start = Point(np.zeros(2), windows.start)
    rng = np.random.default_rng(1)
    away = rng.standard_normal(windows.start.shape) * windows.start_deviation
    later = Point(np.array([0.8, -0.5]), windows.start + away)
    at = linearise(windows, KNOWN, start)
    seen = windows.residuals([plant_at(windows, KNOWN, later.t)], later.starts)[0]
    after = secant(windows, at, later, seen)

    dx = (away / windows.start_deviation).T
    step = np.concatenate([dx, np.tile(later.t, (len(windows), 1))], axis=1)
    said = (derivatives(after) @ step[:, :, None])[:, :, 0]
    changed = (after.residual - at.residual)[:, : said.shape[1]]
    assert np.allclose(said, changed, atol=1e-6 * np.abs(changed).max())
    plain = (derivatives(at) @ step[:, :, None])[:, :, 0]
    assert not np.allclose(plain, changed, atol=1e-3 * np.abs(changed).max())


def test_borrowed_derivatives_have_columns_of_their_own_for_what_is_new(windows, recording):
    """The valve's lag brings a state and a parameter; the columns of the rest are lent."""
    lagging = cut_windows(servo_drive().with_values({LAG: 4e-3}).lean(), [recording], NOISE)
    more = unknowns_of(mass=0.05, coulomb=2.0, lag=1e-3)
    near = linearise(windows, KNOWN, Point(np.zeros(2), windows.start))
    point = Point(np.zeros(3), lagging.start)
    lent = derivatives(borrowed(near, (windows, KNOWN), lagging, more, point))
    own = derivatives(linearise(lagging, more, point))

    states = list(lagging.plant.state_list)
    new = [k for k, name in enumerate(states) if name not in windows.plant.state_list]
    assert len(new) == 1
    for column in (*new, len(states) + 2):
        assert np.allclose(lent[:, :, column], own[:, :, column], rtol=1e-9, atol=1e-9)
    mass = len(states)
    assert np.array_equal(lent[:, :, mass], derivatives(near)[:, :, mass - 1])


def test_a_lent_column_is_counted_in_the_unit_of_its_borrower(windows):
    near = linearise(windows, KNOWN, Point(np.zeros(2), windows.start))
    wider = unknowns_of(mass=0.1, coulomb=2.0)
    point = Point(np.zeros(2), windows.start)
    lent = derivatives(borrowed(near, (windows, KNOWN), windows, wider, point))
    own = derivatives(linearise(windows, wider, point))
    mass = len(windows.plant.state_list)

    size = np.linalg.norm(own[:, :, mass])
    assert np.linalg.norm(lent[:, :, mass] - own[:, :, mass]) < 0.01 * size


def test_a_part_of_the_windows_is_even_and_the_same_data(windows):
    few, kept = windows.part(2)

    assert kept.tolist() == [0, 4]
    assert np.array_equal(few.measured, windows.measured[:, kept])
    assert few.firsts == ((windows.firsts[0][0], windows.firsts[0][4]),)
    assert windows.part(3)[0] is windows

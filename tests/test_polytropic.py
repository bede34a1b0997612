"""Levels of the gas balance side by side (physics.md 1.2): full, polytropic, isothermal."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.plants.crr_rig import crr_rig
from workbench.plants.servo_drive import servo_drive
from workbench.polytropic import with_polytropic_gas
from workbench.recording import Recording
from workbench.simulation import simulate

DT = 1e-3


def pressure_rate_pa_s(plant, pressure_pa):
    """Of chamber a at mid stroke, valve closed and tight, at rest."""
    tight = plant.with_values({"valve.leak_area_m2": 0.0}).lean()
    x = tight.initial
    at = tight.model.states.index("chamber_a.pressure_pa")
    x[at] = pressure_pa
    return float(tight.model.f(x, [4.95], [], tight.nominal[2])[0][at])


def test_a_polytropic_chamber_has_no_mass_state_and_the_same_outputs():
    plant = with_polytropic_gas(crr_rig())

    assert not [name for name in plant.model.states if name.endswith("mass_kg")]
    assert plant.model.measured == crr_rig().measured


def test_at_its_reference_the_polytropic_balance_is_the_full_one():
    """Same pressure, same temperature, same rates: only what follows differs."""
    full = servo_drive().lean()
    reduced = with_polytropic_gas(full, reference_pressure_pa=5.65e5)
    rates = [dict(zip(p.model.states, p.model.f(p.initial, [7.0], [], p.nominal[2])[0].full()[:, 0],
                      strict=True)) for p in (full, reduced)]  # fmt: skip

    for name, rate in rates[1].items():
        assert rate == pytest.approx(rates[0][name], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(("bar", "sign"), [(1.0, 1), (3.0, 1), (7.0, -1)])
def test_with_heat_a_closed_polytropic_chamber_never_rests(bar, sign):
    """Erratum E002-7: it drifts towards P_0; told are +0.44, +0.37 and -0.24 bar/s."""
    plant = with_polytropic_gas(servo_drive())

    rate = pressure_rate_pa_s(plant, 1e5 * bar)
    assert np.sign(rate) == sign
    assert abs(rate) == pytest.approx({1: 0.44e5, 3: 0.37e5, 7: 0.24e5}[int(bar)], rel=0.25)


def stroke(plant):
    """A closed valve and a push by unequal pressures: one compression."""
    shut = plant.with_values({"valve.clearance_m": 0.0})
    parts = tuple(replace(p, initial_pressure_pa=2e5) if p.name == "rod_side" else p
                  for p in shut.parts)  # fmt: skip
    command = np.full(400, 5.25)
    return simulate(replace(shut, parts=parts), Recording("r", DT, {"valve.command_v": command}))


@pytest.mark.parametrize(("exponent", "expected"), [(1.4, 1.4), (1.0, 1.0)])
def test_the_exponent_makes_a_closed_chamber_adiabatic_or_isothermal(exponent, expected):
    plant = with_polytropic_gas(crr_rig().lean(), polytropic_index=1.0, balance_exponent=exponent)
    result = stroke(plant)
    p, y = result["cap.pressure_pa"], result["rod.position_m"]
    volume = 6e-6 + np.pi / 4 * 26.99e-3**2 * y
    slope = -np.polyfit(np.log(volume), np.log(p), 1)[0]

    assert np.ptp(y) > 5e-3
    assert slope == pytest.approx(expected, abs=2e-3)


@pytest.mark.slow
def test_on_the_servo_drive_the_polytropic_model_differs_as_told():
    """Physics.md section 6: 1.4 / 3.4 mm mean and largest, 0.03 bar, over 8 s of the sine."""
    command = 4.95 + 0.8 * np.sin(np.pi * DT * np.arange(8001))
    run = Recording("sine", DT, {"valve.command_v": command})
    full, reduced = (simulate(p, run) for p in (servo_drive(), with_polytropic_gas(servo_drive())))
    off = np.abs(full["slide.position_m"] - reduced["slide.position_m"])

    assert 0.5e-3 < off.mean() < 4e-3
    assert off.max() < 10e-3

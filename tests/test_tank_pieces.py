"""Where a tank curve begins: what the closed valve before it has made of the tank."""

import numpy as np
import pytest

from studies import identification as study
from studies.truth import dedicated as truth
from workbench.identification.tank import tank_on_valve
from workbench.identification.tank_pieces import _at_the_opening, _piece
from workbench.rig import load_rig


def test_a_curve_begins_where_a_leak_has_taken_the_tank_by_the_opening():
    """Paper 002's small tank gains 32 mbar in the tenth of a second before, noise 3 mbar."""
    noise_pa, time_s = 300.0, 0.002 * np.arange(50)
    noise = noise_pa * np.random.default_rng(0).standard_normal((200, 50))
    found = [_at_the_opening(1e5 + 32e3 * time_s + each, 0.002) for each in noise]
    assert np.mean(found) == pytest.approx(1.032e5, abs=20.0)
    assert np.std(found) < 0.35 * noise_pa


def test_a_lead_that_does_not_drift_is_known_by_its_mean():
    leads = 1e5 + 300.0 * np.random.default_rng(1).standard_normal((200, 50))
    found = np.array([_at_the_opening(lead, 0.002) for lead in leads])
    assert np.mean(found == leads.mean(axis=1)) > 0.9
    assert _at_the_opening(np.full(5, 1e5), 0.002) == 1e5


def test_where_the_valve_never_opens_a_curve_begins_with_its_first_samples():
    """Not where these would have led to: the curve has no lead of its own."""
    (curve,) = study.named(truth.tank_curves(study.TANK, np.array([5.0]), seed=1), "curve")
    closed = curve.part(60, len(curve))
    tank = tank_on_valve(load_rig(study.WRONG_TANK), closed)
    pressure = tank.plant.measured[0]
    begun = dict(zip(tank.plant.state_list, _piece(tank, closed).start, strict=True))

    assert np.ptp(closed[tank.plant.commands[0].name]) < 0.02
    assert begun[pressure] == pytest.approx(np.mean(closed[pressure][:5]))

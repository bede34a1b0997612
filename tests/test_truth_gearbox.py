"""The true gearbox agrees with the model where nothing differs, keeps its gas, repeats itself."""

from dataclasses import replace

import numpy as np
import pytest
from gearbox_shifts import POSITION, SHIFTS, run

from studies.truth import gearbox as g
from studies.truth import gearbox_draw as draws
from studies.truth.batch import stack
from studies.truth.cases import read_cases
from studies.truth.gearbox_manoeuvre import SAMPLES, training_command, validation_command
from studies.truth.gearbox_run import energised, open_loop
from studies.truth.plants import GEARBOX
from workbench.plants.gearbox import gearbox

NOMINAL = g.Gearbox()
OUTPUTS = {
    "position_m": POSITION,
    "pressure_1_pa": "chamber_1.pressure_pa",
    "pressure_2_pa": "chamber_2.pressure_pa",
}
SAME = [  # truth and model with the same effects, several at once
    ({}, {}),
    (
        {"exhaust_restriction_2": 0.3, "coulomb_main_n": 20.0, "detent_n": 100.0},
        {
            "valve_2.exhaust_restriction_share": 0.3,
            "friction@main_piston.coulomb_force_n": 20.0,
            "detent.force_n": 100.0,
        },
    ),
]


def truth(members, command, start_m=0.0, **keywords):
    """Readings of some true gearboxes under one command held for some ms: [(c1, c2), ms]."""
    batch = stack(members)
    held = np.tile(np.array(command[0], float)[None, :, None], (command[1], 1, len(members)))
    return open_loop(batch, held, g.at_rest(batch, start_m), **keywords)[0]


@pytest.fixture(scope="module")
def shift():
    """N to H of all the truths of `SAME`, one column each, over 25 ms."""
    return truth([replace(NOMINAL, **changes) for changes, _ in SAME], ((1, 0), 26))


@pytest.mark.parametrize("column", range(len(SAME)))
def test_without_the_small_differences_it_is_the_model(shift, column):
    """To 10 um and 300 Pa, half and a third of the noise, through the bounce in the stop."""
    plant = gearbox().with_values(SAME[column][1]).lean()
    model = run(plant, [((1, 0), 0.025)], 1e-3)

    for name, signal in OUTPUTS.items():
        off = np.abs(shift[name][:, column] - model[signal])
        assert off.max() < (10e-6 if name == "position_m" else 300.0), name
    assert np.ptp(shift["position_m"][:, column]) > 11e-3


@pytest.mark.slow
@pytest.mark.parametrize("name", ["H to N", "N to L", "L to N"])
def test_every_shift_is_that_of_the_model(name):
    """On average to 5 um and 200 Pa; a bounce of 2.3 m/s moves by a few steps at worst.

    At a quarter of the truth's usual step, which alone delays the longest flight by 7 us.
    """
    start_m, command, _ = SHIFTS[name]
    seen = truth([NOMINAL], (command, 61), start_m, substeps=200)
    model = run(gearbox(start_m).lean(), [(command, 0.06)], 1e-3)

    for key, signal in OUTPUTS.items():
        off = np.abs(seen[key][:, 0] - model[signal])
        assert off.mean() < (5e-6 if key == "position_m" else 200.0), key


def test_the_step_is_fine_enough():
    """Half the step changes a whole shift by less than half of the sensor noise."""
    coarse, fine = (truth([NOMINAL], ((0, 1), 22), substeps=n) for n in (50, 100))

    assert np.abs(coarse["position_m"] - fine["position_m"]).max() < 10e-6
    for name in ("pressure_1_pa", "pressure_2_pa"):
        assert np.abs(coarse[name] - fine[name]).max() < 500.0


def test_shut_in_gas_keeps_its_mass_and_its_isentrope():
    """No seat, no port, no heat: two pistons pushed by the gas alone, p V^1.4 in all chambers."""
    shut = replace(
        NOMINAL, discharge_1=0.0, discharge_2=0.0, port_area_m2=0.0, heat_transfer_w_m2_k=0.0
    )
    batch = stack([shut])
    start = g.at_rest(batch)
    start.gas[:2, 0] *= 3.0
    _, states = open_loop(batch, np.zeros((20, 2, 1)), start, keep=(0, 19))
    first, last = states[0], states[19]
    grown = [g.volumes(batch, s.body[0], s.body[1])[:, 0] for s in (first, last)]

    assert abs(last.body[0, 0] - first.body[0, 0]) > 1e-3
    np.testing.assert_array_equal(last.gas[0], first.gas[0])
    energy = [s.gas[1, :, 0] * volume**0.4 for s, volume in zip((first, last), grown, strict=True)]
    np.testing.assert_allclose(energy[1], energy[0], rtol=1e-5)


def test_a_delayed_command_reaches_its_coil_later_and_the_other_does_not():
    batch = stack([replace(NOMINAL, delay_1_s=2.5e-3), NOMINAL])
    command = np.zeros((6, 2, 2))
    command[1:] = 1.0
    on = energised(batch, command, 50).reshape(-1, 2, 2)

    assert np.argmax(on, axis=0).tolist() == [[175, 50], [50, 50]]


def test_a_saturated_coil_and_a_warm_one_open_later():
    members = [NOMINAL, replace(NOMINAL, saturation_per_a=1.0), replace(NOMINAL, coil_1_ohm=39.0)]
    pressure = truth(members, ((1, 0), 6))["pressure_1_pa"][5]

    assert pressure[0] > pressure[1] + 1e4 and pressure[0] > pressure[2] + 1e4


def test_a_synchroniser_holds_the_finger_in_its_zone():
    blocked = truth([replace(NOMINAL, synchroniser_n=1500.0)], ((1, 0), 60))["position_m"][:, 0]

    assert 4.9e-3 < blocked[-1] < 7e-3 and np.ptp(blocked[-20:]) < 0.3e-3


@pytest.mark.parametrize("name", draws.EFFECTS)
def test_every_effect_is_absent_at_its_null(name):
    case = draws.draw(name, 3)
    off, on = draws.gearbox_of(case, "hidden"), draws.gearbox_of(case)

    assert off != on
    assert 0.10 <= abs(case.size) / draws.EFFECTS[name].typical <= 0.60
    assert all(getattr(off, field) == 0.0 for field in draws.EFFECTS[name].fields)


def test_an_unknown_effect_is_refused():
    with pytest.raises(KeyError, match="is not a hidden effect"):
        draws.draw("gremlin", 1)


@pytest.mark.parametrize("seed", range(5))
def test_the_manoeuvres_shift_both_ways_and_release(seed):
    for manoeuvre in (training_command, validation_command):
        command = manoeuvre(np.random.default_rng(seed))

        assert command.shape == (SAMPLES, 2) and set(np.unique(command)) == {0.0, 1.0}
        for pair in ((1, 0), (0, 1), (1, 1), (0, 0)):
            assert (command == pair).all(axis=1).mean() > 0.03


def test_the_stored_cases_are_those_of_the_draw():
    """What a misfit rule changed is noted: factors of differences, and redraws of the size."""
    stored = read_cases(GEARBOX.stored)

    assert sorted({seed for _, seed in stored}) == [1, 2]
    for (hidden, seed), case in stored.items():
        drawn, factors = draws.draw(hidden, seed), dict(case.shrunk)
        changes = {x.field: x.change * factors.get(x.field, 1.0) for x in drawn.differences}
        assert {x.field: x.change for x in case.differences} == pytest.approx(changes, rel=1e-12)
        assert case.redraws or case.size == drawn.size
        assert len(case.differences) > 25

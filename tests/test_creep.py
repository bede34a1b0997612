"""Where a creeping wall stands when a window begins."""

import numpy as np

from workbench.fitting.starts import guessed_states
from workbench.plants import PLANTS
from workbench.recording import Recording
from workbench.simulation import simulate

DT = 2.5e-3  # 400 Hz, the rate of paper 004
FOLLOWED = "bellows_creep.followed_pa"
CREEP = {"bellows_creep.creep_m3_pa": 2e-10, "bellows_creep.creep_time_s": 3.0}


def run(plant, duty, start_pa):
    x0 = np.array(plant.initial)
    x0[plant.model.states.index("bellows.pressure_pa")] = start_pa
    return simulate(plant, Recording("run", DT, {"valve.pwm": duty}), x0)


def test_no_window_has_a_creep_of_its_own():
    """A free one would be a free volume in each: it follows from the pressures recorded before.

    What a wall of half the time would have followed, and one that begins unsettled, stay possible.
    """
    plant = PLANTS["soft_joint"]().with_values(CREEP).lean()
    swift = plant.with_values({"bellows_creep.creep_time_s": 1.5})
    duty = 0.5 + 0.05 * np.sign(np.sin(0.2 * np.pi * DT * np.arange(16_001)))
    for true, begun_pa in (plant, 1e5), (swift, 1.01325e5), (plant, 1.6e5):
        recorded = run(true, duty, begun_pa)
        followed_pa = recorded[FOLLOWED]
        guess, deviation = guessed_states(plant, recorded)
        row = plant.model.states.index(FOLLOWED)

        assert np.ptp(followed_pa) > 5e4
        assert (np.abs(guess[row] - followed_pa) < deviation[row]).all()
        assert deviation[row][-4000:].max() < 0.3 * np.ptp(followed_pa)

"""Sensors that stand still: coarse ones are told where the plant moves; no clock seems uneven."""

# ruff: noqa: F811  (fixtures of other tests)

from dataclasses import replace

import numpy as np
import pytest
from test_adversarial_recordings import COMMAND, PLACE, A, demo, said  # noqa: F401

from studies import adversarial as spoil
from workbench.comparison import compare
from workbench.consistency import Weight, trusted
from workbench.reading import RecordingWarning
from workbench.recording import Recording
from workbench.rig import default_rig
from workbench.simulation import simulate


@pytest.mark.parametrize(("name", "step"), [(PLACE, 2e-4), (A, 2e3)])
def test_a_coarse_sensor_that_stands_still_while_the_plant_moves_is_told(demo, name, step):
    """It repeats values anyway, and the plant may rest there: its samples are kept."""
    rig, train, _ = demo
    coarse = replace(train, channels={**train.channels, name: step * np.round(train[name] / step)})
    ((kept,),), findings = trusted(rig, [spoil.stuck(name, 3.0)(coarse)])
    (finding,) = (each for each in findings if "stands at" in each.what)

    assert said(rig, coarse) == []
    assert finding.weight is Weight.NOTICE and "to 9.999 s, while the plant" in finding.what
    assert np.isfinite(kept[name]).all()


def test_a_sensor_that_sticks_makes_no_clock_uneven():
    """The bare chamber stands still as its sensor does, and noise ends where it begins to."""
    t = 0.1 * np.arange(1400)
    pressure = 8e5 * np.exp(-t / 200.0) + 200.0 * np.random.default_rng(0).standard_normal(1400)
    pressure[400:] = pressure[400]
    stood = Recording("stood", 0.1, {"chamber.pressure_pa": pressure})

    assert said(default_rig("closed_chamber"), stood) == []


def test_a_constant_output_is_told_and_stops_nothing(demo):
    """It has no noise: any motion of the plant is more."""
    rig, train, _ = demo
    dead = replace(train, channels={**train.channels, A: np.full(len(train), train[A][0])})
    ((kept,),), findings = trusted(rig, [dead])
    (finding,) = findings

    assert said(rig, dead) == [(Weight.NOTICE, f"{finding.channel} {finding.what}")]
    assert finding.what.startswith("stands at 5.6079 bar from 0 to 9.999 s, while the plant")
    assert np.isfinite(kept[A]).all()
    with pytest.warns(RecordingWarning, match="stands at"):
        compare(rig, [dead])


def test_nothing_is_said_of_a_constant_output_of_a_plant_at_rest():
    chamber = default_rig("closed_chamber")
    level_pa = chamber.ambient_pa
    still = Recording("still", 0.1, {"chamber.pressure_pa": np.full(400, level_pa)})

    assert said(chamber, still) == []


def test_noise_that_may_be_slow_sampling_says_so(demo):
    """Every 50 ms of what moves within less looks like noise from sample to sample."""
    rig, train, _ = demo
    rng = np.random.default_rng(3)
    noise = replace(train, channels={**train.channels, A: 5e5 + 1e4 * rng.standard_normal(10_000)})
    ((_, told),) = said(rig, noise)
    command_v = 5.0 + 2.0 * rng.standard_normal(400)
    fast = simulate(rig.plant, Recording("fast", 1e-3, {COMMAND: np.repeat(command_v, 20)}))
    every = {name: values[::50] for name, values in fast.channels.items()}
    slow = said(rig, Recording("slow", 0.05, every))

    assert "is noise: " in told and "slowly" not in told
    assert slow and all(
        "is noise, or sampled too slowly (50 ms) for what moves here: " in line for _, line in slow
    )

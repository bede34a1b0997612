"""What tells the friction laws apart: creep below break-away (physics.md 1.3)."""

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pytest

from workbench.effect import Effect, Force
from workbench.effects.bristle_friction import ElastoPlastic, LuGre
from workbench.effects.friction_thermal import ThermalFriction
from workbench.fitting.starts import guessed_states
from workbench.parts import Body
from workbench.plant import Plant, Signal
from workbench.plants.servo_drive import servo_drive
from workbench.recording import Recording
from workbench.simulation import simulate

WARMTH = "friction_thermal.warmer_k"


@dataclass(frozen=True, kw_only=True)
class Push(Effect):
    """A force that is commanded."""

    def terms(self, now):
        yield Force("slide", now["push"].command_n)


def pushed(plasticity):
    """Travel in m under 15 N +- 10 N at 20 Hz, half of break-away, for 3 s."""
    friction = next(effect for effect in servo_drive().effects if effect.name == "friction")
    friction = replace(friction, plasticity=plasticity, chambers=())
    plant = Plant(
        name="slide",
        parts=(Body(name="atmosphere"), Body(name="slide", mass_kg=2.22)),
        effects=(friction, Push(name="push")),
        commands=(Signal("push.command_n", nominal=0.0),),
        measured=("slide.position_m",),
    )
    time_s = 1e-3 * np.arange(3001)
    force = 15.0 + 10.0 * np.sin(2 * np.pi * 20.0 * time_s)
    y = simulate(plant, Recording("push", 1e-3, {"push.command_n": force}))["slide.position_m"]
    return y[2950:].mean() - y[50:100].mean()


def test_lugre_creeps_under_a_load_that_the_elasto_plastic_law_holds():
    """Told: 0.79 mm and 0.3 micrometre in 3 s."""
    assert pushed(LuGre()) == pytest.approx(0.79e-3, rel=0.1)
    assert abs(pushed(ElastoPlastic())) < 1e-6


def test_the_bristle_is_symbolic_too():
    z = ca.SX.sym("z")

    assert LuGre()(z, z, z) == 1.0
    assert ElastoPlastic()(z, z, z).is_scalar()


def test_a_seal_is_guessed_as_warm_as_its_strokes_make_it():
    values = {"friction_thermal.softening_n_k": 0.5, "friction_thermal.warming_time_s": 30.0}
    plant = servo_drive().with_values(values).lean()
    command = 4.95 + 1.5 * np.sign(np.sin(np.pi * 1e-3 * np.arange(20_000)))
    run = simulate(plant, Recording("strokes", 1e-3, {"valve.command_v": command}))

    guess, deviation = guessed_states(plant, run)
    row = plant.model.states.index(WARMTH)

    assert run[WARMTH][-1] > 1.0
    assert np.abs(guess - run[WARMTH])[row].max() < 0.05 * run[WARMTH][-1]
    assert (deviation[row] < 1.0).all()


def test_no_window_has_a_warmth_of_its_own():
    """A free one would be a free friction in each window, which imitates what changes by stroke.

    What another warming time would have made of the strokes is within the deviation, though.
    """
    time_s = 1e-3 * np.arange(60_001)
    speed_m_s = 0.3 * np.cos(2 * np.pi * 0.5 * time_s)
    seen = {"time_s": time_s, "slide.velocity_m_s": speed_m_s}
    thermal = ThermalFriction(name="friction_thermal", body="slide", softening_n_k=1.0)
    slower = replace(thermal, warming_time_s=1.2 * thermal.warming_time_s)

    (warmth, deviation), (other, _) = (each.guess(seen)["warmer_k"] for each in (thermal, slower))

    assert warmth[-1] > 3.0
    assert (np.abs(other - warmth) < deviation).all()
    assert deviation[:10_000].max() < 0.02 and deviation[-1] < 0.05 * warmth[-1]

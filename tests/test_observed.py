"""What outputs tell of states: a mass that is pushed."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from estimators.observed import observed
from workbench.effect import Effect, Force
from workbench.parts import Body
from workbench.plant import Plant, Signal
from workbench.plant_filter import PlantFilter

DT_S, NOISE_M, KICK = 0.01, 1e-3, 0.5
POSITION, VELOCITY = "mass.position_m", "mass.velocity_m_s"


@dataclass(frozen=True, kw_only=True)
class Push(Effect):
    def terms(self, now):
        yield Force("mass", now["push"].force_n)


@dataclass(frozen=True, kw_only=True)
class Drag(Effect):
    """Stops the mass within milliseconds."""

    def terms(self, now):
        yield Force("mass", -1e4 * now["mass"].velocity_m_s)


def pushed(measured, *more, kick=KICK):
    plant = Plant(
        name="pushed",
        parts=(Body(name="mass", mass_kg=1.0),),
        effects=(Push(name="push"), *more),
        commands=(Signal("push.force_n", nominal=0.0, lower=-1.0, upper=1.0),),
        measured=(measured,),
    )
    found = PlantFilter(
        plant=plant,
        sample_time_s=DT_S,
        measurement_noise={measured: NOISE_M},
        process_noise={VELOCITY: kick},
    )
    return observed(found, np.zeros((2, 400)), np.zeros((1, 400)))


def test_a_position_shows_the_velocity_too_as_well_as_the_riccati_equation_says():
    found = pushed(POSITION)
    F, half = np.array([[1.0, DT_S], [0.0, 1.0]]), np.diag([0.0, KICK**2]) * DT_S / 2
    H, Q = np.array([[1.0, 0.0]]), F @ half @ F.T + half
    P = solve_discrete_are(F.T, H.T, Q, np.array([[NOISE_M**2]]))
    P -= P @ H.T @ H @ P / (P[0, 0] + NOISE_M**2)

    assert found.unseen == ()
    assert [*found.within.values()] == pytest.approx(np.sqrt(np.diag(P)), rel=1e-3)


def test_a_velocity_does_not_show_where_the_mass_is():
    found = pushed(VELOCITY)

    assert found.unseen == (POSITION,)
    assert found.within[VELOCITY] < 0.1 * found.without[VELOCITY]


def test_what_has_died_away_to_nothing_counts_as_certain():
    found = pushed(POSITION, Drag(name="drag"), kick=0.0)

    assert found.within[VELOCITY] == 0.0  # not 1e-100 m/s
    assert found.within[POSITION] > 0.0

"""Which plants pass the look at a user's own: those of the list, and what only looks like wrong."""

import time
from dataclasses import dataclass, replace

import casadi as ca
import pytest
from conftest import PLANT_MODELS

from workbench import cause_checks, plant_checks, plant_numbers
from workbench.effect import Effect, Force, HeatFlow, MassFlow, Part, Term, form, strength
from workbench.effects import FivePortValve, SensorLag, SupplyDroop
from workbench.errors import InputError
from workbench.parts import Atmosphere, Body, Chamber, Supply
from workbench.plant import Plant, Signal
from workbench.plant_checks import check_plant
from workbench.plants import PLANTS
from workbench.vessel import Vessel


@dataclass(frozen=True, kw_only=True)
class Tank(Part):
    """A pressure that somebody holds, a part of a user's own."""

    pressure_pa: float = form(7e5)

    def derive(self, now):
        return {"pressure_pa": self.pressure_pa, "temperature_k": 293.0}


@dataclass(frozen=True, kw_only=True)
class Orifice(Effect):
    """A valve that is there whatever its flaw."""

    flaw_kg_s: float = strength(typical=1e-3)

    @property
    def absent(self):
        return False

    def terms(self, now):
        flow_kg_s = 1e-8 * (now["supply"].pressure_pa - now["tank"].pressure_pa) + self.flaw_kg_s
        yield MassFlow("tank", flow_kg_s, 293.0)
        yield MassFlow("supply", -flow_kg_s, 293.0)
        yield HeatFlow("supply", 1.0)


class Stir(Term):
    """A flow of a user's own."""


@dataclass(frozen=True, kw_only=True)
class Bath(Part):
    """A part of a user's own that takes flows of a user's own."""

    def close(self, now, received):
        return {"stirred": sum(term.value for term in received("bath") if isinstance(term, Stir))}


@dataclass(frozen=True, kw_only=True)
class Spoon(Effect):
    """What stirs."""

    into: str = "bath"

    def terms(self, now):
        yield Stir(self.into, 2.0)


@pytest.mark.parametrize("name", PLANTS)
def test_the_plants_of_the_list_pass_as_if_they_were_somebodys_own(name, monkeypatch):
    for module in (cause_checks, plant_checks, plant_numbers):
        monkeypatch.setattr(module, "own", lambda member: True)

    check_plant(PLANT_MODELS[name])


def test_a_plant_as_large_as_the_drive_is_looked_at_in_a_moment():
    plant = PLANT_MODELS["servo_drive"]
    assert plant.model
    begun = time.process_time()
    check_plant(plant)

    assert time.process_time() - begun < 0.8  # 0.05 s on an idle core


@pytest.mark.parametrize("supply", [Supply(name="supply"), Tank(name="supply")])
def test_gas_may_be_taken_from_where_there_is_enough(supply):
    check_plant(
        Plant(
            name="mine",
            parts=(supply, Vessel(name="tank")),
            effects=(Orifice(name="valve"),),
            measured=("tank.pressure_pa",),
        )
    )


def test_a_supply_that_droops_takes_what_is_drawn():
    plant = PLANTS["servo_reservoir"]()

    assert any(isinstance(effect, SupplyDroop) for effect in plant.effects)
    assert not plant_checks.lost_flows(plant)
    assert not plant_checks.lost_flows(plant.without("supply_droop"))


def test_forces_on_a_body_whose_motion_is_recorded_are_no_mistake():
    """Nothing moves it but the recording; only the gas is simulated."""
    plant = Plant(
        name="held",
        parts=(
            Supply(name="supply"),
            Atmosphere(name="atmosphere"),
            Chamber(name="chamber_a", body="slide", side=1),
        ),
        effects=(FivePortValve(name="valve", first="chamber_a"),),
        commands=(Signal("valve.command_v", nominal=5.0, lower=0.0, upper=10.0),),
        measured_inputs=(Signal("slide.position_m", 0.0), Signal("slide.velocity_m_s", 0.0)),
        measured=("chamber_a.pressure_pa",),
    )

    check_plant(plant)


def test_a_flow_of_ones_own_arrives_where_a_part_of_ones_own_takes_it():
    parts = Bath(name="bath"), Body(name="slide")
    plant = Plant(name="mine", parts=parts, effects=(Spoon(name="a"),), measured=("bath.stirred",))
    check_plant(plant)

    lost = replace(plant, effects=(Spoon(name="a", into="slide"),))
    with pytest.raises(
        InputError, match=r"a puts a Stir into slide.*no Stir; expected one of bath"
    ):
        check_plant(lost)


def test_a_sensor_may_stand_on_an_output_that_is_not_always_recorded():
    lag = SensorLag(name="lag", signal="slide.velocity_m_s", unit=1.0)
    plant = Plant(
        name="mine",
        parts=(Body(name="slide"),),
        effects=(lag,),
        measured=("slide.position_m",),
        optional_outputs=("slide.velocity_m_s",),
    )
    check_plant(plant)
    unseen = replace(plant, optional_outputs=())

    with pytest.raises(InputError, match=r"lag acts on slide.velocity_m_s, which is no signal"):
        check_plant(unseen)


def test_what_moves_samples_at_its_null_is_not_absent():
    @dataclass(frozen=True, kw_only=True)
    class Late(Effect):
        """A delay that is always there."""

        more_s: float = strength(typical=1e-3)

        def resample(self, channel, values, sample_time_s):
            return values - 1.0 if channel == "slide.position_m" else values

    plant = Plant(
        name="mine",
        parts=(Body(name="slide"),),
        effects=(Late(name="late"),),
        measured=("slide.position_m",),
    )
    with pytest.raises(InputError, match=r"late moves samples of slide.position_m with all"):
        check_plant(plant)


def test_a_number_that_cannot_be_is_put_down_to_a_users_own_member():
    """What reads it is not a number either, and it is not to blame."""

    @dataclass(frozen=True, kw_only=True)
    class Wind(Part):
        """A part of a user's own, born without a speed."""

        def derive(self, now):
            return {"speed_m_s": ca.SX.nan()}

    @dataclass(frozen=True, kw_only=True)
    class Sail(Effect):
        """A force by it."""

        area: float = strength(typical=1.0)

        def terms(self, now):
            yield Force("slide", self.area * now["wind"].speed_m_s)

    plant = Plant(
        name="mine",
        parts=(Wind(name="wind"), Body(name="slide")),
        effects=(Sail(name="sail"),),
        measured=("slide.position_m",),
    )
    with pytest.raises(InputError, match=r"^wind.speed_m_s is nan at the start"):
        check_plant(plant)

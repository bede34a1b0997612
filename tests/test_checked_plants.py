"""Which plants pass the look at a user's own: those of the list, and what only looks like wrong."""

import time
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pytest
from conftest import PLANT_MODELS

from workbench import cause_checks, plant_checks, plant_numbers
from workbench.effect import (
    Balance,
    Cause,
    Effect,
    Force,
    HeatFlow,
    MassFlow,
    Part,
    State,
    Term,
    form,
    strength,
)
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


WORDS = dict(balance=Balance.MOMENTUM, drivers=(), shown_by="", source="")


@dataclass(frozen=True, kw_only=True)
class Own(Effect):
    """An effect of a user's own, that does what a test says."""

    causes = (
        Cause(name="size", strength="size", forms=("less",), **WORDS),
        Cause(name="less", strength="less", needs="size", **WORDS),
    )
    size: float = strength(typical=1.0)
    less: float = strength(typical=0.5)
    trim: float = strength(typical=0.0, lower=-1.0, upper=1.0)  # of no cause
    signal: str | None = None
    signals: tuple[str, ...] = ()
    forces: object = None  # of the effect and the position, what it puts into the slide
    shift: object = None  # of the effect and a signal, what comes of the signal
    sample: object = None  # of the effect and a sequence, what comes of the sequence

    def terms(self, now):
        x_m = now["slide"].position_m
        return [Force("slide", f) for f in (self.forces(self, x_m) if self.forces else ())]

    def alter(self, signal, value, now):
        mine = signal.startswith(self.signal or "slide.position") or signal in self.signals
        return self.shift(self, value) if self.shift and mine else value

    def resample(self, channel, values, sample_time_s):
        return self.sample(self, values) if self.sample else values


@dataclass(frozen=True, kw_only=True)
class Regulated(Part):
    def states(self):
        yield from (State("pressure_pa", 7e5, 1e5), State("position_m", 0.1, 0.1))

    def derive(self, now):
        return {"temperature_k": 293.0, "text": "x", "none": None, "vector": ca.SX([1, 2])}

    def rates(self, now, received):
        own = now[self.name]
        return {"pressure_pa": 6e5 - own.pressure_pa, "position_m": 0.2 - own.position_m}


def slide(*effects, parts=()):
    parts = (Body(name="slide"), *parts)
    return Plant(name="mine", parts=parts, effects=effects, measured=("slide.position_m",))


@pytest.mark.parametrize(
    "own",
    [
        dict(forces=lambda e, x_m: [-e.size / x_m**2]),
        dict(forces=lambda e, x_m: [ca.if_else(e.size > 0, 1 / e.size, 0.0)]),
        dict(forces=lambda e, x_m: [ca.if_else(e.less > 0, e.size / ca.log(e.less / e.size), 0)]),
        dict(shift=lambda e, value: value + ca.if_else(e.size > 0, 1 / e.size, 0)),
        dict(shift=lambda e, value: 0.3 * ca.sin(ca.asin(value / 0.3) + e.size)),
        dict(forces=lambda e, x_m: [x_m / 1.1 * (1 - e.size) ** 1.7, -x_m / 1.1]),
        dict(forces=lambda e, x_m: [9.81 * (ca.sin(0.3 + e.size) - 0.3 + 0.3 - ca.sin(0.3))]),
        dict(sample=lambda e, values: [1.0 / e.size]),
        dict(sample=lambda e, values: np.convolve(values, np.eye(1, 999)[0])[: len(values)]),
        dict(signal="slide.pos", shift=lambda e, value: value + e.size),
        dict(signal="slide.velocity_m_s", shift=lambda e, value: value + e.size),
        dict(signals=("slide.position_m", "b.position_m"), shift=lambda e, value: value + e.size),
    ],
    ids=lambda own: next(iter(own)),
)
def test_what_only_looks_like_wrong_passes(own):
    """Singular at the start or at null, guarded, rounded, or of signals in a sense of its own."""
    check_plant(slide(Own(name="own", **own)))


def test_a_part_that_goes_its_own_way_takes_what_comes():
    @dataclass(frozen=True, kw_only=True)
    class Pull(Effect):
        def terms(self, now):
            yield from (Force("slide", 1.0), Force("other", -1.0), MassFlow("other", 1e-3, 293.0))

    check_plant(slide(Pull(name="pull"), parts=(Regulated(name="other"),)))


def test_what_is_left_at_null_is_no_rounding_where_it_is_a_share_of_what_it_does():
    faulty = Own(name="own", forces=lambda e, x_m: [x_m * (1.0 - e.size), -0.999999 * x_m])
    with pytest.raises(InputError, match=r"own puts a Force of -?\S+e-0\d N into slide with all"):
        check_plant(slide(faulty))

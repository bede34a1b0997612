"""The plants of study ``hidden-effects``: how a truth's tables and names read in the catalogue.

A new plant is its truth (``studies/truth/plants.py``) and one ``Bench`` here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from studies.truth import plants
from studies.truth.case import Case
from studies.truth.plants import Table, Truth
from studies.truth.soft_joint_run import SAMPLE_TIME_S as SOFT_JOINT_SAMPLE_TIME_S
from workbench.recording import Recording
from workbench.rig import Rig, default_rig


@dataclass(frozen=True)
class Bench:
    """One plant of the study.

    Attributes
    ----------
    truth
        What records the cases.
    channels
        Signal and factor to SI of each column of a recorded table.
    always_there
        Small differences that every truth has and the catalogue can name: naming one of them where
        nothing is hidden is right.
    laws
        Balances, as a diagnosis names them, in which a law outside the catalogue acts.
    places
        Catalogue's name of a hidden effect where it is not the truth's.
    sample_time_s
        Of the recorded tables.
    """

    truth: Truth
    channels: Mapping[str, tuple[str, float]]
    always_there: tuple[str, ...]
    laws: Mapping[str, tuple[str, ...]]
    places: Mapping[str, str] = field(default_factory=dict)
    sample_time_s: float = 1e-3

    def always_has(self, name: str) -> bool:
        """True for a small difference that every truth has, by its public name with its place."""
        return name.partition("@")[0] in self.always_there

    @property
    def plant(self) -> str:
        """The plant's name in the workbench, and in the cases."""
        return self.truth.plant

    def public_name(self, case: Case) -> str | None:
        """The hidden effect as the catalogue names it; None where it is not in there."""
        if case.hidden not in self.truth.hidden:
            return None
        return self.places.get(case.hidden, case.hidden)

    def user_rig(self, *cases: Case) -> Rig:
        """The rig of a user who does not know of what these cases hide."""
        rig = default_rig(self.plant)
        for name in filter(None, map(self.public_name, cases)):
            candidate = rig.plant.candidates[name]
            plant, removed = rig.plant.at_null(candidate), (*rig.removed, name)
            rig = replace(rig, plant=plant, removed=removed)
        return rig

    def recording(self, table: Table, name: str) -> Recording:
        """A recorded table in SI units and the plant's signals."""
        channels = {
            public: np.asarray(table[column]) * factor
            for column, (public, factor) in self.channels.items()
            if column in table
        }
        return Recording(name, self.sample_time_s, channels, source="studies/truth")

    def recorded(self, name: str, tables: tuple[Table, Table]) -> tuple[Recording, Recording]:
        """Training and validation."""
        train, held_out = tables
        return self.recording(train, f"{name} training"), self.recording(held_out, f"{name} other")


SERVO_DRIVE = Bench(
    truth=plants.SERVO_DRIVE,
    channels={
        "command_V": ("valve.command_v", 1.0),
        "position_mm": ("slide.position_m", 1e-3),
        "pressure_a_bar": ("chamber_a.pressure_pa", 1e5),
        "pressure_b_bar": ("chamber_b.pressure_pa", 1e5),
        "supply_bar": ("supply.pressure_pa", 1e5),
    },
    always_there=("valve_lag", "command_delay", "sensor_lag", "friction_position"),
    laws={
        "quadratic_drag": ("slide.momentum",),
        "sagging_cable": ("slide.momentum",),
        "sticky_spot": ("slide.momentum",),
        "magnetic_catch": ("slide.momentum",),
        "sliding_leak": ("chamber_a.mass",),
        "purge_flow": ("chamber_b.mass",),
    },
    places={
        "chamber_leak": "chamber_leak@chamber_a",
        "chamber_leak_b": "chamber_leak@chamber_b",
        "sensor_offset": "sensor_offset@chamber_a.pressure",
        "sensor_scale": "sensor_scale@slide.position",
    },
)
CRR_RIG = Bench(
    truth=plants.CRR_RIG,
    channels={
        "command_V": ("valve.command_v", 1.0),
        "position_mm": ("rod.position_m", 1e-3),
        "cap_bar": ("cap.pressure_pa", 1e5),
        "rod_side_bar": ("rod_side.pressure_pa", 1e5),
        "supply_bar": ("supply.pressure_pa", 1e5),
    },
    always_there=(
        "valve_lag",
        "command_delay",
        "sensor_lag",
        "friction_position",
        "wall_heat",
        "area_shape",
    ),
    laws={"quadratic_drag": ("rod.momentum",)},
    places={
        "chamber_leak": "chamber_leak@cap",
        "sensor_offset": "sensor_offset@cap.pressure",
    },
)
SOFT_JOINT = Bench(
    truth=plants.SOFT_JOINT,
    channels={
        "command": ("valve.pwm", 1.0),
        "pressure_bar": ("bellows.pressure_pa", 1e5),
        "supply_bar": ("supply.pressure_pa", 1e5),
    },
    always_there=(
        "valve_lag",
        "command_delay",
        "sensor_lag",
        "area_shape",
        "volume_expansion",
        "bellows_creep",
    ),
    laws={"joint_motion": ("bellows.mass", "bellows.energy")},  # of a volume that changes
    places={"sensor_offset": "sensor_offset@bellows.pressure"},
    sample_time_s=SOFT_JOINT_SAMPLE_TIME_S,
)
GEARBOX = Bench(
    truth=plants.GEARBOX,
    channels={
        "command_1": ("valve_1.command", 1.0),
        "command_2": ("valve_2.command", 1.0),
        "position_mm": ("main_piston.position_m", 1e-3),
        "pressure_1_bar": ("chamber_1.pressure_pa", 1e5),
        "pressure_2_bar": ("chamber_2.pressure_pa", 1e5),
        "supply_bar": ("supply.pressure_pa", 1e5),
    },
    always_there=("sensor_lag", "command_delay", "friction_position"),
    laws={"quadratic_drag": ("main_piston.momentum",)},
    places={
        "coulomb_friction": "coulomb_friction@main_piston",
        "viscous_friction": "viscous_friction@main_piston",
        "command_delay": "command_delay@valve_1",
        "exhaust_restriction": "exhaust_restriction@valve_2",
    },
)
BENCHES = {bench.plant: bench for bench in (SERVO_DRIVE, CRR_RIG, SOFT_JOINT, GEARBOX)}


def bench_of(case: Case) -> Bench:
    """The bench of a case's plant."""
    return BENCHES[case.plant]

"""The procedures of paper 002 against what was put into the truth: recordings, answers, tables.

Makes the dedicated recordings with `studies/truth/dedicated.py`, gives the procedures, in their
order, rigs that are wrong in what they are to find, and prints what they found beside the truth and
beside what paper 002 prints.  ``workbench study identification`` runs it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from studies.text import columns, percent, shown
from studies.truth import dedicated as truth
from studies.truth import drive as true
from workbench.identification import PROCEDURES
from workbench.identification.dead_volume import dead_volume
from workbench.identification.dead_zone import dead_zone
from workbench.identification.friction import friction
from workbench.identification.result import Identified
from workbench.identification.tank_curves import tank_curves
from workbench.identification.wall_heat import wall_heat
from workbench.recording import Recording
from workbench.rig import load_rig
from workbench.units import public_name
from workbench.whole_file import whole_file

CHANNELS = {
    # column of the truth: channel, column of the file, its unit, and how many of those a SI unit is
    "command_v": ("valve.command_v", "command_V", "V", 1.0),
    "position_m": ("slide.position_m", "position_mm", "mm", 1e3),
    "pressure_a_pa": ("chamber_a.pressure_pa", "pressure_a_bar", "bar", 1e-5),
    "pressure_b_pa": ("chamber_b.pressure_pa", "pressure_b_bar", "bar", 1e-5),
    "pressure_pa": ("reservoir.pressure_pa", "pressure_bar", "bar", 1e-5),
    "supply_pa": ("supply.pressure_pa", "supply_bar", "bar", 1e-5),
}
TANK = truth.Tank()
DRIVE = replace(
    true.Drive(),
    wall_k_per_j=1 / 120.0,
    valve_period_s=0.01,
    friction_wave=0.07,
    presliding_share=0.6,
)
WRONG_TANK = """name = "tank as it was bought"
plant = "servo_reservoir"
[values]
"valve_dead_zone.half_width" = "0.35 V"
"valve_dead_zone.centre" = "5 V"
"valve.supply_fraction" = 0.7
"valve.exhaust_fraction" = 0.75
"valve.leak_area" = "0.03 mm^2"
"""
WRONG_DRIVE = """name = "drive as it was bought"
plant = "servo_drive"
[values]
"valve_dead_zone.half_width" = "0.35 V"
"valve_dead_zone.centre" = "5 V"
"valve.supply_fraction" = 0.7
"valve.exhaust_fraction" = 0.75
"valve.leak_area" = "0.03 mm^2"
"wall_heat.coefficient" = "40 W/(m^2 K)"
"friction.coulomb_force" = "18 N"
"friction.stiction_excess" = "10 N"
"friction.viscous" = "60 N s/m"
"friction.asymmetry" = 0
"chamber_a.dead_volume" = "20 cm^3"
"chamber_b.dead_volume" = "40 cm^3"
"""
RUNS_V = np.array([5.5, 5.6, 5.8, 6.0, 6.3, 4.4, 4.3, 4.1, 3.9, 3.6])
STICKING_V = np.array([5.385, 5.38, 4.52, 4.515])
PUSH_M = (0.25, 0.12)
PULL_M = (0.12, true.STROKE_M)
"""Ends with the chamber full at ambient, where the paper's time constant was measured."""


@dataclass(frozen=True)
class Answer:
    """What one procedure found, and what the truth has, by name."""

    found: Identified
    true: Mapping[str, float]


def recording(table: truth.Table, name: str) -> Recording:
    """A table of the truth as a recording."""
    channels = {CHANNELS[key][0]: values for key, values in table.items() if key in CHANNELS}
    return Recording(name, float(table["time_s"][1]), channels, source="studies/truth")


def recordings() -> dict[str, list[Recording]]:
    """The dedicated recordings by procedure."""
    return {
        "flow": recordings_of_flow(0.2),
        "dead-zone": [recording(truth.static_map(TANK, seed=2), "map")],
        "wall-heat": recordings_of_heat(),
        "dead-volume": [
            recording(truth.reservoir_release(DRIVE, true.STROKE_M, "a", seed=4), "release_a"),
            recording(truth.reservoir_release(DRIVE, 0.0, "b", seed=5), "release_b"),
        ],
        "friction": recordings_of_friction(),
    }


def recordings_of_heat() -> list[Recording]:
    """A pull that ends as the paper's did, and a push."""
    volume_m3 = [DRIVE.dead_volume_a_m3 + true.PISTON_AREA_M2 * length_m for length_m in PULL_M]
    start_pa = DRIVE.ambient_pressure_pa * volume_m3[1] / volume_m3[0]
    return [
        recording(truth.pushed_piston(DRIVE, *PULL_M, seed=8, start_pa=start_pa), "pull"),
        recording(truth.pushed_piston(DRIVE, *PUSH_M, seed=3), "push"),
    ]


def recordings_of_flow(step_v: float, tank: truth.Tank = TANK) -> list[Recording]:
    """A tank curve every so many volts."""
    command_v = np.round(np.arange(0.0, 10.0 + 1e-9, step_v), 3)
    return named(truth.tank_curves(tank, command_v, seed=1), "curve")


def recordings_of_friction() -> list[Recording]:
    """Runs at constant commands, and commands under which the piston sticks and slips."""
    return [
        *named(truth.constant_commands(DRIVE, RUNS_V, 6, 1.5, substeps=25), "run"),
        *named(truth.constant_commands(DRIVE, STICKING_V, 7, 5.0, substeps=25), "stick"),
    ]


def named(tables: list[truth.Table], name: str) -> list[Recording]:
    """Tables as recordings with a number behind their name."""
    return [recording(table, f"{name}_{k:02d}") for k, table in enumerate(tables, start=1)]


def true_values() -> dict[str, dict[str, float]]:
    """What the truth has of what each procedure tells."""
    ways = {"forward": 1.0, "backward": -1.0}
    forces = {}
    for way, side in ways.items():
        coulomb = DRIVE.coulomb_n * (1 + side * DRIVE.coulomb_asymmetry)
        excess = DRIVE.stiction_excess_n * (1 + side * DRIVE.stiction_asymmetry)
        forces[f"coulomb_{way}_n"] = coulomb
        forces[f"static_{way}_n"] = coulomb + excess
        forces[f"viscous_{way}_n_s_m"] = DRIVE.viscous_n_s_m * (1 + side * DRIVE.viscous_asymmetry)
    swept = true.PISTON_AREA_M2 * true.STROKE_M
    dead = {"a": DRIVE.dead_volume_a_m3, "b": DRIVE.dead_volume_b_m3}
    limits = {"lower_limit_v": TANK.valve.lower_v, "upper_limit_v": TANK.valve.upper_v}
    return {
        "flow": {},
        "dead-zone": {**limits, "valve.leak_area_m2": TANK.valve.leak_m2},
        "wall-heat": true_heat(),
        "dead-volume": {
            **{f"chamber_{side}.total_volume_m3": each + swept for side, each in dead.items()},
            **{f"chamber_{side}.dead_volume_m3": each for side, each in dead.items()},
        },
        "friction": forces,
    }


def true_heat() -> dict[str, float]:
    """Coefficient, and the time constant at rest where the pull ends.

    tau = m c_v / k,    k = lambda A sqrt(p / p_0), gas and wall at room temperature
    """
    length_m, end_pa = PULL_M[1], DRIVE.ambient_pressure_pa
    volume_m3 = DRIVE.dead_volume_a_m3 + true.PISTON_AREA_M2 * length_m
    surface_m2 = 2 * true.PISTON_AREA_M2 + np.pi * true.BORE_M * length_m
    mass_kg = end_pa * volume_m3 / (true.GAS_CONSTANT_J_KG_K * true.HEAT_TEMPERATURE_K)
    load = float(np.sqrt(end_pa / true.HEAT_PRESSURE_PA))
    conductance_w_k = DRIVE.heat_transfer_w_m2_k * surface_m2 * load
    return {
        "rest_time_constant_s": mass_kg * true.CV_J_KG_K / conductance_w_k,
        "wall_heat.coefficient_w_m2_k": DRIVE.heat_transfer_w_m2_k,
    }


def answers(data: Mapping[str, list[Recording]]) -> dict[str, Answer]:
    """What the procedures find, each in its recordings and behind what must be known before."""
    tank, drive = load_rig(WRONG_TANK), load_rig(WRONG_DRIVE)
    limits = dead_zone(tank, data["dead-zone"])
    volumes = dead_volume(drive, data["dead-volume"])
    found = {
        "dead-zone": limits,
        "flow": tank_curves(limits.improved(), data["flow"]),
        "dead-volume": volumes,
        "wall-heat": wall_heat(volumes.improved(), data["wall-heat"]),
        "friction": friction(drive, data["friction"]),
    }
    known = true_values()
    return {name: Answer(each, known[name]) for name, each in found.items()}


def table(found: Mapping[str, Answer]) -> str:
    """One line per number: paper 002, truth, rig before, identified, error."""
    rows = []
    for name, answer in found.items():
        before, print_of = answer.found.rig.plant.values, PROCEDURES[name].printed
        for each in (*answer.found.estimates, *answer.found.parameters):
            if each.name not in answer.true and each.name not in print_of:
                continue
            real = answer.true.get(each.name, float("nan"))
            printed = print_of.get(each.name, float("nan"))
            had = before.get(each.name, float("nan"))
            numbers = (printed, real, had, each.value, each.deviation)
            error = percent(each.value / real - 1.0, 1)
            rows.append(
                (name, public_name(each.name), *(shown(x, each.name) for x in numbers), error)
            )
    head = ("procedure", "number", "paper 002", "truth", "rig had", "identified", "std", "error")
    return columns(head, rows)


def flow_table(answer: Answer) -> str:
    """MAE of the tank curves over the commands of the paper's claim."""
    curves, errors = answer.found.curves, answer.found.rig_errors_pa
    rows = []
    for low, high in ((0.0, 1.0), (1.0, 4.5), (4.5, 5.5), (5.5, 10.0)):
        inside = [low <= curve.command_v <= high for curve in curves]
        own = [c.mean_absolute_error for c, k in zip(curves, inside, strict=True) if k]
        rig = [e for e, k in zip(errors, inside, strict=True) if k]
        goal = "0.04 bar" if (low, high) in ((1.0, 4.5), (5.5, 10.0)) else "-"
        told = (shown(max(x), "error_pa", 2) if x else "-" for x in (own, rig))
        rows.append((f"{low:g} to {high:g} V", goal, *told))
    return columns(("command", "paper 002, below", "largest MAE", "with the improved rig"), rows)


def write_files(data: Mapping[str, list[Recording]], folder: Path) -> None:
    """All recordings as CSV, and the two rigs that read them."""
    for read in data.values():
        for each in read:
            known = [row for row in CHANNELS.values() if row[0] in each.channels]
            head = ",".join(["time_s", *(column for _, column, _, _ in known)])
            values = [each.time_s, *(each[name] * factor for name, _, _, factor in known)]
            with whole_file(folder / f"{each.name}.csv") as unfinished:
                np.savetxt(
                    unfinished, np.column_stack(values), "%.6f", ",", header=head, comments=""
                )
    for name, text, keys in (
        ("tank", WRONG_TANK, ("command_v", "pressure_pa", "supply_pa")),
        ("drive", WRONG_DRIVE, ("command_v", "position_m", "pressure_a_pa", "pressure_b_pa")),
        ("drive_and_tank", WRONG_DRIVE, tuple(key for key in CHANNELS if key != "pressure_pa")),
    ):
        lines = [text, '[recording]\ntime = { column = "time_s", unit = "s" }']
        lines.append("[recording.channels]")
        for key in keys:
            channel, column, unit, _ = CHANNELS[key]
            lines.append(f'"{public_name(channel)}" = {{ column = "{column}", unit = "{unit}" }}')
        with whole_file(folder / f"{name}.toml") as unfinished:
            unfinished.write_text("\n".join(lines) + "\n", encoding="utf-8")

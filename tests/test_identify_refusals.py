"""Recordings of the wrong kind, given to `workbench identify` as a user would: one line, exit 2."""

from dataclasses import replace

import numpy as np
import pytest
from commands import call

from studies import identification as study
from workbench.recording import Recording
from workbench.rig import load_rig
from workbench.rig_writing import write_rig

ZONE = ("valve_dead_zone.centre_v", "valve_dead_zone.half_width_v", "valve.leak_area_m2")
STEP_S = 2e-3
LEAD = 50
TIME_S = STEP_S * np.arange(1000)


def tank(command_v, pressure_pa, supply_pa=7e5):
    """A recording of the tank with the noise of its sensors."""
    n = len(command_v)
    noise = np.random.default_rng(3).standard_normal
    channels = {
        "valve.command_v": np.asarray(command_v, float),
        "reservoir.pressure_pa": pressure_pa + 500.0 * noise(n),
        "supply.pressure_pa": supply_pa + 500.0 * noise(n),
    }
    return Recording("bad", STEP_S, channels)


def curve(command_v=8.0, start=1e5, end=7e5, supply_pa=7e5, closed_v=4.95):
    """A tank curve that goes from one pressure to another in half a second."""
    opened = np.arange(len(TIME_S)) >= LEAD
    along = 1.0 - np.exp(-np.clip(TIME_S - STEP_S * LEAD, 0.0, None) / 0.1)
    pressure = start + (end - start) * along
    return tank(np.where(opened, command_v, closed_v), pressure, supply_pa)


def sweep(end=7e5, period_s=20.0, supply_pa=7e5):
    """A sine of the command with a pressure between ambient and an end."""
    time_s = STEP_S * np.arange(round(period_s / STEP_S))
    phase = 2 * np.pi * time_s / period_s
    pressure = 1e5 + 0.5 * (end - 1e5) * (1 - np.cos(phase))
    return tank(4.95 + 1.2 * np.sin(phase), pressure, supply_pa)


def drive(position_m, a_pa=2e5, supply_pa=None, seconds=2.0):
    """A recording of the drive; what is constant has noise."""
    n = round(seconds / STEP_S)
    noise = np.random.default_rng(3).standard_normal
    channels = {
        "valve.command_v": np.full(n, 5.6),
        "slide.position_m": position_m + 5e-6 * noise(n),
        "chamber_a.pressure_pa": a_pa + 500.0 * noise(n),
        "chamber_b.pressure_pa": 1e5 + 500.0 * noise(n),
    }
    if supply_pa is not None:
        channels["supply.pressure_pa"] = supply_pa + 500.0 * noise(n)
    return Recording("bad", STEP_S, channels)


def drooping():
    return np.linspace(7e5, 5.5e5, len(TIME_S))


def moving():
    return np.linspace(0.02, 0.25, 1000)


def let_out(from_pa):
    """The pressure of a chamber or tank that an open valve empties: an exponential, too."""
    return np.where(
        TIME_S < 0.5, from_pa, 1.1e5 + (from_pa - 1.1e5) * np.exp(-(TIME_S - 0.5) / 0.1)
    )


def risen(seconds, at_s=1.0, to_pa=5e5):
    """The pressure of a chamber that is filled at a time."""
    return np.where(STEP_S * np.arange(round(seconds / STEP_S)) < at_s, 1e5, to_pa)


BAD = {
    "flow, supply gives way": ("flow", lambda: curve(supply_pa=drooping()), "is not constant"),
    "flow, never charged": ("flow", lambda: curve(end=1e5), "the tank is never charged"),
    "flow, never emptied": ("flow", lambda: curve(2.0, 7e5, 7e5), "the tank is never emptied"),
    "flow, begins full": ("flow", lambda: curve(start=7e5, end=7e5), "is never charged"),
    "flow, begins open": ("flow", lambda: curve(closed_v=7.0), "begin with the valve closed, at 7"),
    "flow, another supply": ("flow", lambda: curve(end=6e5), "comes to rest at 6 bar, its supply"),
    "flow, another ambient": ("flow", lambda: curve(2.0, 6e5, 5e4), "its ambient is 1"),
    "flow, one curve": ("flow", curve, "1 charging and 0 discharging curves"),
    "flow, a sweep": ("flow", sweep, "the command changes again"),
    "dead zone, too fast": ("dead-zone", lambda: sweep(period_s=2.0), "the command moves at"),
    "dead zone, tank stays": ("dead-zone", lambda: sweep(end=2e5), "moves by 1 bar only"),
    "dead zone, supply gives way": (
        "dead-zone",
        lambda: sweep(supply_pa=np.linspace(7e5, 5e5, 10_000)),
        "the supply is not constant",
    ),
    "dead zone, another supply": (
        "dead-zone",
        lambda: sweep(end=6.2e5),
        "comes to rest at 6.2",
    ),
    "heat, no push": ("wall-heat", lambda: drive(0.1), "the piston never moves"),
    "heat, no decay": (
        "wall-heat",
        lambda: drive(np.where(TIME_S < 0.5, 0.2, 0.1), np.where(TIME_S < 0.5, 2e5, 4e5)),
        "is no thermal decay: chamber_a moves by",
    ),
    "heat, let out by the valve": (
        "wall-heat",
        lambda: drive(np.where(TIME_S < 0.5, 0.01, 0.28), let_out(4e5)),
        "of the gas before the push is there at the end",
    ),
    "heat, a tank let out": (
        "wall-heat",
        lambda: tank(np.full(1000, 3.0), let_out(7e5)),
        "are more than heat does",
    ),
    "volume, no tank": ("dead-volume", lambda: drive(0.29), "the tank is not recorded"),
    "volume, piston free": (
        "dead-volume",
        lambda: drive(moving(), supply_pa=7e5),
        "the piston moves by 230 mm",
    ),
    "volume, never let in": (
        "dead-volume",
        lambda: drive(0.29, 1e5, 7e5),
        "rises by",
    ),
    "volume, no still piece": (
        "dead-volume",
        lambda: drive(0.29, risen(2.0, at_s=0.05), 5e5),
        "before the release",
    ),
    "volume, ends early": (
        "dead-volume",
        lambda: drive(0.29, risen(4.0), 5e5, seconds=4.0),
        "s after the release",
    ),
    "friction, at rest": ("friction", lambda: drive(0.1), "shows no friction"),
    "friction, one run": ("friction", lambda: drive(moving()), "1 runs forward and 0 back"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_wrong_recording_gets_one_line_and_nothing_is_written(name, tmp_path):
    procedure, made, said = BAD[name]
    bad = made()
    study.write_files({procedure: [bad]}, tmp_path)
    rig = tmp_path / ("tank" if "reservoir.pressure_pa" in bad.channels else "drive")
    if procedure == "dead-volume" and "supply.pressure_pa" in bad.channels:
        rig = tmp_path / "drive_and_tank"
    rig = rig.with_suffix(".toml")
    known = load_rig(rig)
    names = ZONE if procedure == "flow" else ("chamber_a.dead_volume_m3",)
    if procedure == "flow" or (procedure == "wall-heat" and rig.stem == "drive"):
        write_rig(replace(known, deviations={n: 1e-3 * known.plant.values[n] for n in names}), rig)
    before = set(tmp_path.iterdir())
    files = ("-o", tmp_path / "better.toml", "--json", tmp_path / "found.json")
    answer = call(
        "identify", procedure, rig, tmp_path / "bad.csv", *files, "--figures", tmp_path / "f", "-q"
    )

    assert answer.exit_code == 2, answer.output
    assert said in answer.stderr
    assert "bad.csv" in answer.stderr
    assert len(answer.stderr.splitlines()) == 1
    assert set(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("procedure", "made", "first"),
    [("flow", curve, "dead-zone"), ("wall-heat", None, "dead-volume")],
)
def test_an_earlier_result_that_is_missing_is_asked_for(procedure, made, first, tmp_path):
    decay = np.where(TIME_S < 0.5, 1e5, 1e5 + 5e4 * np.exp(-(TIME_S - 0.5) / 0.3))
    given = made() if made else drive(np.where(TIME_S < 0.5, 0.2, 0.1), decay)
    study.write_files({procedure: [given]}, tmp_path)
    rig = tmp_path / ("tank.toml" if procedure == "flow" else "drive.toml")
    better = tmp_path / "better.toml"
    answer = call("identify", procedure, rig, tmp_path / "bad.csv", "-o", better, "-q")

    assert answer.exit_code == 2
    assert f"workbench identify {first}" in answer.stderr
    assert len(answer.stderr.splitlines()) == 1
    assert not better.exists()

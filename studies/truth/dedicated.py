"""Dedicated recordings for identification, each of one manoeuvre, in SI and with real sensors.

Tank curves, a slow sine on the tank, a plugged chamber whose piston is pushed, constant commands
and commands just outside the dead zone on the drive, a tank that is let into a locked chamber.
Gas, walls and sensors are richer than any model: walls warm up, pressure readings lag, all
readings have noise and steps, the opening of the valve is no plain power of the command.

Source: physics.md 5 (S002-1 to S002-7); sizes from 2.4.
"""

from dataclasses import dataclass, replace

import numpy as np

from studies.truth import drive as d
from studies.truth.batch import stack
from studies.truth.gas_network import (
    ROOM_K,
    Network,
    constant_volumes,
    lagged,
    passed,
    run,
    tabulated,
)
from studies.truth.integrate import open_loop
from studies.truth.restriction import iso6358, nozzle
from studies.truth.run import (
    COMMAND_STEP_V,
    POSITION_NOISE_M,
    POSITION_STEP_M,
    PRESSURE_NOISE_PA,
    PRESSURE_STEP_PA,
)

Table = dict[str, np.ndarray]
PRESSURE_LAG_S = 1.5e-3
CLOSED_V = 4.95
LEAK = tabulated(nozzle)
LEAD_S = 0.1  # the valve stays closed that long before a curve begins


@dataclass(frozen=True)
class TankValve:
    """One port of the valve on a tank: supply path, exhaust path and the leak beside them.

    Opening of a path at a share s of its command: 1 - (1 - s)^exponent, with a ripple of
    `ripple` sin(2 pi s) that no power has.
    """

    lower_v: float = 4.53
    upper_v: float = 5.37
    supply_m2: float = d.FULL_AREA_M2 * d.SUPPLY_AREA_SHARE
    exhaust_m2: float = d.FULL_AREA_M2 * d.EXHAUST_AREA_SHARE
    supply_exponent: float = 1.65
    exhaust_exponent: float = 1.55
    ripple: float = 0.02
    supply_critical: float = 0.35
    exhaust_critical: float = 0.30
    leak_m2: float = 8e-8

    def areas_m2(self, command_v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Areas of supply and exhaust path, before the discharge coefficient."""
        up = np.clip((command_v - self.upper_v) / (d.COMMAND_RANGE_V - self.upper_v), 0, 1)
        down = np.clip((self.lower_v - command_v) / self.lower_v, 0, 1)
        return (
            self.supply_m2 * self._opening(up, self.supply_exponent),
            self.exhaust_m2 * self._opening(down, self.exhaust_exponent),
        )

    def _opening(self, share: np.ndarray, exponent: float) -> np.ndarray:
        return 1 - (1 - share) ** exponent + self.ripple * np.sin(2 * np.pi * share)


@dataclass(frozen=True)
class Tank:
    """The identification rig: a tank on one port.  Source: physics.md 2.4, `servo_reservoir`."""

    valve: TankValve = TankValve()
    volume_m3: float = 0.344e-3
    surface_m2: float = 3.419e-2
    heat_transfer_w_m2_k: float = 17.275
    supply_pa: float = 7e5
    ambient_pa: float = 1e5

    def network(self, command_v, columns: int) -> Network:
        """The tank under commands t -> (n_columns,)."""
        valve = self.valve
        supply, outside = (self.supply_pa, ROOM_K), (self.ambient_pa, ROOM_K)

        inlet, outlet = (
            tabulated(lambda ratio, b=b: d.DISCHARGE * d.CHOKED * iso6358(ratio, b))
            for b in (valve.supply_critical, valve.exhaust_critical)
        )

        def flows(t, pressure, temperature):
            charging_m2, venting_m2 = valve.areas_m2(command_v(t))
            gas = (pressure, temperature)
            streams = (
                passed(charging_m2, inlet, supply, gas),
                passed(valve.leak_m2, LEAK, supply, gas),
                passed(-venting_m2, outlet, gas, outside),
                passed(-valve.leak_m2, LEAK, gas, outside),
            )
            return sum(s[0] for s in streams), sum(s[1] for s in streams)

        size = np.ones((1, columns))
        volumes = constant_volumes(self.volume_m3 * size, self.surface_m2 * size)
        return Network(volumes, flows, self.heat_transfer_w_m2_k)


def tank_curves(tank: Tank, command_v: np.ndarray, seed: int, length_s: float = 3.0) -> list[Table]:
    """One curve per command, 500 Hz: charging from ambient above 5 V, else from full.

    Each begins 0.1 s before the valve is opened.
    """
    step_s, command_v = 2e-3, np.round(command_v / COMMAND_STEP_V) * COMMAND_STEP_V
    samples, lead = round((LEAD_S + length_s) / step_s), round(LEAD_S / step_s)
    start_pa = np.where(command_v >= 5.0, tank.ambient_pa, tank.supply_pa)[None]

    def commands(t):
        return np.where(t < LEAD_S - 1e-9, CLOSED_V, command_v)

    true_pa = run(tank.network(commands, len(command_v)), start_pa, samples, step_s)
    rng = np.random.default_rng(seed)
    read = lagged(true_pa[:, 0], PRESSURE_LAG_S, step_s)
    sent = np.where(np.arange(samples)[:, None] < lead, CLOSED_V, command_v)
    return [_tank_table(step_s, sent[:, k], read[:, k], tank, rng) for k in range(len(command_v))]


def static_map(
    tank: Tank,
    seed: int,
    amplitude_v: float = 1.2,
    period_s: float = 20.0,
    periods: float = 2.0,
    step_s: float = 4e-3,
) -> Table:
    """Periods of a sine about the closed valve, by default two slow ones, from ambient."""
    valve_lag_s = 1 / (2 * np.pi * 100.0)

    def command(t):
        return CLOSED_V + amplitude_v * np.sin(2 * np.pi * np.asarray(t) / period_s)

    def spool(t):
        return np.atleast_1d(command(max(t - valve_lag_s, 0.0)))

    samples = round(periods * period_s / step_s)
    true_pa = run(tank.network(spool, 1), np.array([[tank.ambient_pa]]), samples, step_s)
    sent = command(step_s * np.arange(samples))
    sent = np.round(sent / COMMAND_STEP_V) * COMMAND_STEP_V
    read = lagged(true_pa[:, 0, 0], PRESSURE_LAG_S, step_s)
    return _tank_table(step_s, sent, read, tank, np.random.default_rng(seed))


def pushed_piston(
    drive: d.Drive,
    from_m: float,
    to_m: float,
    seed: int,
    start_pa: float | None = None,
    leak_m2: float = 2e-10,
) -> Table:
    """Chamber a plugged, by default at ambient, the piston moved in 0.15 s and held; 5 s, 1 kHz."""
    start_pa = drive.ambient_pressure_pa if start_pa is None else start_pa
    step_s, samples, begins_s, lasts_s = 1e-3, 5000, 0.3, 0.15

    def position(t):
        phase = np.clip((np.asarray(t) - begins_s) / lasts_s, 0.0, 1.0)
        return from_m + (to_m - from_m) * 0.5 * (1 - np.cos(np.pi * phase))

    def speed(t):
        inside = begins_s < t < begins_s + lasts_s
        angle = np.pi * (t - begins_s) / lasts_s
        return (to_m - from_m) * 0.5 * np.pi / lasts_s * np.sin(angle) if inside else 0.0

    def volumes(t):
        volume = drive.dead_volume_a_m3 + d.PISTON_AREA_M2 * position(t)
        surface = 2 * d.PISTON_AREA_M2 + np.pi * d.BORE_M * position(t)
        return tuple(np.full((1, 1), x) for x in (volume, d.PISTON_AREA_M2 * speed(t), surface))

    def flows(t, pressure, temperature):
        outside = (drive.ambient_pressure_pa, ROOM_K)
        return passed(-leak_m2, LEAK, (pressure, temperature), outside)

    network = Network(volumes, flows, drive.heat_transfer_w_m2_k)
    true_pa = run(network, np.full((1, 1), start_pa), samples, step_s)[:, 0, 0]
    rng, time_s = np.random.default_rng(seed), step_s * np.arange(samples)
    return dict(
        time_s=time_s,
        command_v=np.full(samples, CLOSED_V),
        position_m=_read(position(time_s), POSITION_NOISE_M, POSITION_STEP_M, rng),
        pressure_a_pa=_pressure(lagged(true_pa, PRESSURE_LAG_S, step_s), rng),
        pressure_b_pa=_pressure(np.full(samples, drive.ambient_pressure_pa), rng),
    )


def constant_commands(
    drive: d.Drive, command_v: np.ndarray, seed: int, length_s: float, substeps: int = 50
) -> list[Table]:
    """The drive under one constant command each, from rest at the far end of its stroke, 1 kHz.

    A command above the centre starts at 10 mm with chamber pressures that balance, one below it at
    280 mm.
    """
    samples = round(length_s / 1e-3)
    start_m = np.where(command_v > drive.dead_zone_centre_v, 0.010, 0.280)
    return commanded(
        drive, np.broadcast_to(command_v, (samples, len(command_v))), start_m, seed, substeps
    )


def commanded(
    drive: d.Drive, command_v: np.ndarray, start_m, seed: int, substeps: int = 50
) -> list[Table]:
    """The drive under commands (n_samples, n_columns), from rest at these places, 1 kHz."""
    command_v = np.round(command_v / COMMAND_STEP_V) * COMMAND_STEP_V
    samples, n = command_v.shape
    batch = stack([replace(drive, pressure_lag_s=PRESSURE_LAG_S)] * n)
    state = d.at_rest(batch, start_m, 0.8 * drive.supply_pressure_pa)
    out = open_loop(batch, command_v, state, substeps)
    rng = np.random.default_rng(seed)
    return [
        dict(
            time_s=1e-3 * np.arange(samples),
            command_v=command_v[:, k],
            position_m=_read(out["position_m"][:, k], POSITION_NOISE_M, POSITION_STEP_M, rng),
            pressure_a_pa=_pressure(out["pressure_a_pa"][:, k], rng),
            pressure_b_pa=_pressure(out["pressure_b_pa"][:, k], rng),
        )
        for k in range(n)
    ]


def reservoir_release(
    drive: d.Drive,
    position_m: float,
    chamber: str,
    seed: int,
    tank: Tank | None = None,
    leak_m2: float = 1e-9,
    start_pa: float | None = None,
) -> Table:
    """The full tank let into a locked chamber, by default at ambient, after 1 s; 40 s at 100 Hz.

    The tank stands where the supply was, so its pressure is the supply's channel.  A seal leaks.
    """
    tank, step_s, samples, opens_s = tank or Tank(), 1e-2, 4000, 1.0
    length_m = position_m if chamber == "a" else d.STROKE_M - position_m
    dead_m3 = drive.dead_volume_a_m3 if chamber == "a" else drive.dead_volume_b_m3
    volume = np.array([[tank.volume_m3], [dead_m3 + d.PISTON_AREA_M2 * length_m]])
    around_m2 = 2 * d.PISTON_AREA_M2 + np.pi * d.BORE_M * length_m
    surface = np.array([[tank.surface_m2], [around_m2]])

    def flows(t, pressure, temperature):
        first, second = ((pressure[k], temperature[k]) for k in (0, 1))
        tap_m2 = 1e-6 if t >= opens_s else 0.0
        over, carried = passed(tap_m2, LEAK, first, second)
        lost, taken = passed(leak_m2, LEAK, second, (drive.ambient_pressure_pa, ROOM_K))
        return np.stack([-over, over - lost]), np.stack([-carried, carried - taken])

    network = Network(constant_volumes(volume, surface), flows, drive.heat_transfer_w_m2_k)
    chamber_pa = drive.ambient_pressure_pa if start_pa is None else start_pa
    first_pa = np.array([[tank.supply_pa], [chamber_pa]])
    true_pa = run(network, first_pa, samples, step_s, substeps=2)[:, :, 0]
    rng = np.random.default_rng(seed)
    filled, other = _pressure(true_pa[:, 1], rng), np.full(samples, drive.ambient_pressure_pa)
    pressures = (filled, _pressure(other, rng))
    return dict(
        time_s=step_s * np.arange(samples),
        command_v=np.full(samples, CLOSED_V),
        position_m=_read(np.full(samples, position_m), POSITION_NOISE_M, POSITION_STEP_M, rng),
        pressure_a_pa=pressures[0] if chamber == "a" else pressures[1],
        pressure_b_pa=pressures[1] if chamber == "a" else pressures[0],
        supply_pa=_pressure(true_pa[:, 0], rng),
    )


def _tank_table(step_s: float, command_v, read_pa, tank: Tank, rng) -> Table:
    supply = np.full(len(read_pa), tank.supply_pa)
    return dict(
        time_s=step_s * np.arange(len(read_pa)),
        command_v=command_v,
        pressure_pa=_pressure(read_pa, rng),
        supply_pa=_pressure(supply, rng),
    )


def _pressure(value: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return _read(value, PRESSURE_NOISE_PA, PRESSURE_STEP_PA, rng)


def _read(value: np.ndarray, noise: float, step: float, rng: np.random.Generator) -> np.ndarray:
    return step * np.round((value + noise * rng.standard_normal(len(value))) / step)

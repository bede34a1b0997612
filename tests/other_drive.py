"""A servo drive as somebody else would simulate it, with another valve; no code of the workbench.

Explicit Euler steps of 0.1 ms for position, speed, bristle, and mass and temperature of both
chambers.  The lands open as (s)^1.6 behind their dead zone, slowly at first, where the workbench
and ``studies/truth`` have 1 - (1 - s)^1.6; nothing else is missing.  Its sensors are prompt.
"""

import numpy as np

from workbench.recording import Recording

STEP_S, SAMPLE = 1e-4, 10
GAS, KAPPA, ROOM_K, SUPPLY_PA, AMBIENT_PA = 288.0, 1.4, 293.15, 7e5, 1e5
FACE_M2, BORE_M, STROKE_M, MASS_KG = 4.9087e-4, 0.025, 0.29, 2.22
DEAD_M3 = np.array([3.105e-5, 5.525e-5])
CENTRE_V, HALF_V, LAND_M2, LEAK_M2, LATE_S = 4.95, 0.42, 2.8274e-5, 8e-8, 2.1e-3
WALL_W_M2_K, STIFF_N_M = 22.5, 1.12e6
COULOMB_N, STICTION_N, STRIBECK_M_S, VISCOUS_N_S_M = 27.3, 21.3, 0.024, 44.0
NOISE_M, NOISE_PA = 5e-6, 400.0


def pulses(seed, length_s, largest_v):
    """Pulses to either side in turn, 0.2 to 0.4 s long, with pauses; one value per 0.1 s."""
    rng = np.random.default_rng(seed)
    command, k, side = np.full(round(10 * length_s) + 1, CENTRE_V), 3, 1.0
    while k < len(command):
        held = rng.integers(2, 5)
        command[k : k + held] = CENTRE_V + side * rng.uniform(0.55, largest_v)
        k += held + rng.integers(1, 5)
        side = -side
    return command


def flow_kg_s(area_m2, from_pa, to_pa, from_k):
    """Through a restriction, elliptic below a critical ratio of 0.35; backwards at room heat."""
    if from_pa < to_pa:
        return -flow_kg_s(area_m2, to_pa, from_pa, ROOM_K)
    below = max((to_pa / from_pa - 0.35) / 0.65, 0.0)
    return 0.65 * area_m2 * from_pa / np.sqrt(GAS * from_k) * np.sqrt(1.0 - below**2)


def opened_m2(past_v):
    """A land so far past the centre."""
    return LAND_M2 * (max(past_v - HALF_V, 0.0) / (10.0 - CENTRE_V - HALF_V)) ** 1.6


def recorded(seed, length_s=8.0, largest_v=1.1):
    """What its sensors show of pulses, at 1 kHz."""
    command, rng = pulses(seed, length_s, largest_v), np.random.default_rng(seed)
    place, speed, bristle = 0.145, 0.0, 0.0
    pressure, heat = np.array([5.65e5, 5.65e5]), np.full(2, ROOM_K)
    rows = []
    for step in range(round(length_s / STEP_S)):
        past_v = command[max(int(10 * (step * STEP_S - LATE_S)), 0)] - CENTRE_V
        if step % SAMPLE == 0:
            rows.append((command[int(10 * step * STEP_S)], place, *pressure))
        lands = opened_m2(past_v) + LEAK_M2, opened_m2(-past_v) + LEAK_M2
        pressure, heat = gas(pressure, heat, lands, place, speed)
        resisting = COULOMB_N + STICTION_N * np.exp(-((speed / STRIBECK_M_S) ** 2))
        bristle += STEP_S * (speed - STIFF_N_M * abs(speed) * bristle / resisting)
        force = (pressure[0] - pressure[1]) * FACE_M2 - STIFF_N_M * bristle - VISCOUS_N_S_M * speed
        beyond = place - min(max(place, 0.0), STROKE_M)
        force -= 2e6 * beyond + 2e3 * speed * (beyond != 0.0)
        speed += STEP_S * force / MASS_KG
        place += STEP_S * speed
    command_v, *outputs = np.array(rows).T
    sizes = (NOISE_M, NOISE_PA, NOISE_PA)
    read = [y + rng.normal(0.0, size, len(y)) for y, size in zip(outputs, sizes, strict=True)]
    names = ("slide.position_m", "chamber_a.pressure_pa", "chamber_b.pressure_pa")
    channels = {"valve.command_v": command_v, **dict(zip(names, read, strict=True))}
    return Recording(f"other drive {seed}", 1e-3, channels)


def gas(pressure, heat, lands, place, speed):
    """Pressures and temperatures of both chambers a step later."""
    volumes = DEAD_M3 + FACE_M2 * np.array([place, STROKE_M - place])
    swept, found = FACE_M2 * np.array([speed, -speed]), []
    for k, (fill, vent) in enumerate((lands, lands[::-1])):
        comes = flow_kg_s(fill, SUPPLY_PA, pressure[k], ROOM_K)
        goes = flow_kg_s(vent, pressure[k], AMBIENT_PA, heat[k])
        mass, stored = pressure[k] * volumes[k] / (GAS * heat[k]), GAS / (KAPPA - 1.0)
        walls_m2 = 2.0 * FACE_M2 + np.pi * BORE_M * volumes[k] / FACE_M2
        power = (stored + GAS) * (comes * (ROOM_K if comes > 0 else heat[k]) - goes * heat[k])
        power += WALL_W_M2_K * walls_m2 * (ROOM_K - heat[k]) - pressure[k] * swept[k]
        warmed = heat[k] + STEP_S * (power - stored * heat[k] * (comes - goes)) / (mass * stored)
        mass += STEP_S * (comes - goes)
        found.append((mass * GAS * warmed / (volumes[k] + STEP_S * swept[k]), warmed))
    later_pa, later_k = np.array(found).T
    return later_pa, later_k

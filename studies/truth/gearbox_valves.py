"""Both solenoid valves of the true gearbox over one sample, by the midpoint rule.

    L di/dt = U - R_c i - i dL/dx v,   L = N^2/R_m,  dL/dx = L/(R_m mu0 A_p)
    m dv/dt = B i^2/2 dL/dx - F_0 - k x - d v + stops,   B = 1 / (1 + (i/i_s)^2)
    R_m = R_m0 + gap / (mu0 A_p),  gap = g_res + x_max - x

No pressure acts on the armature, so the valves do not depend on the rest.  B stands for a core that
saturates.  Source: physics.md 2.5 and 8.2 (the armature is clipped before it enters the circuit).
"""

import numpy as np

from studies.truth import gearbox as g

_POLE = 4e-7 * np.pi * g.POLE_M2


def advance_valves(
    p: g.Gearbox, state: g.State, on: np.ndarray, step_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """Lift at every step of a sample, and state after it.

    `on`, shape (n_steps, 2, n), is 1 where a valve is energised; the lifts have the same shape.
    """
    valve = state.valve
    coil = np.stack([p.coil_1_ohm, p.coil_2_ohm])
    lifts = np.empty(on.shape)
    for k, energised in enumerate(on):
        lifts[k] = _lift(valve)
        middle = valve + 0.5 * step_s * _rates(p, valve, lifts[k], coil, energised)
        valve = valve + step_s * _rates(p, middle, _lift(middle), coil, energised)
    return lifts, valve


def _lift(valve: np.ndarray) -> np.ndarray:
    return np.minimum(np.maximum(valve[1], 0.0), g.LIFT_M)


def _rates(p: g.Gearbox, valve, lift, coil, energised) -> np.ndarray:
    current, place, speed = valve
    reluctance = p.core_per_h + (g.RESIDUAL_GAP_M + g.LIFT_M - lift) / _POLE
    inductance = g.TURNS**2 / reluctance
    slope = inductance / (reluctance * _POLE)
    clamp = np.minimum(np.maximum(current / g.QUENCHED_A, -1.0), 1.0)
    across = np.where(energised > 0.5, p.supply_voltage_v, -g.CLAMP_V * clamp)
    across -= current * (coil + slope * np.where(lift == place, speed, 0.0))
    square = current**2
    force = 0.5 * square * slope / (1.0 + p.saturation_per_a**2 * square)
    force -= p.preload_n + p.spring_n_m * place + g.ARMATURE_N_S_M * speed
    depth = lift - place  # positive below the seat, negative above the upper stop
    stop = g.ARMATURE_STOP[0] * depth - g.ARMATURE_STOP[1] * speed
    force += np.where(depth > 0, np.maximum(stop, 0), np.where(depth < 0, np.minimum(stop, 0), 0))
    return np.stack([across / inductance, speed, force / g.ARMATURE_KG])


def seat_areas(p: g.Gearbox, lifts: np.ndarray) -> np.ndarray:
    """Effective areas of inlet 1, exhaust 1, inlet 2, exhaust 2 and port, shape (n_steps, 5, n)."""
    inlet = np.minimum(np.pi * g.INLET_M * lifts, np.pi / 4 * g.INLET_M**2)
    left = g.LIFT_M - lifts
    exhaust = np.minimum(np.pi * g.EXHAUST_M * left, np.pi / 4 * g.EXHAUST_M**2)
    port = np.broadcast_to(p.port_area_m2, inlet[:, 0].shape)
    rows = [
        p.discharge_1 * inlet[:, 0],
        p.discharge_1 * exhaust[:, 0],
        p.discharge_2 * inlet[:, 1],
        p.discharge_2 * (1.0 - p.exhaust_restriction_2) * exhaust[:, 1],
        port,
    ]
    return np.stack(rows, axis=1)

"""Random draws of a truth: one hidden effect and the small differences that are always on.

Source: physics.md 2.4 (nominal values), 6 (effects); the sizes are those of the test bench.
"""

from dataclasses import replace

import numpy as np

from studies.truth.case import (
    SMALLEST_SHARE,
    Case,
    Difference,
    Hidden,
    differences_of,
    drawn_size,
    generator,
    hidden_fields,
    require_known,
    true_fields,
)
from studies.truth.drive import Drive

NOMINAL = Drive()


EFFECTS = {
    "valve_dead_zone": Hidden(("dead_zone_half_width_v",), 0.6),
    "valve_lag": Hidden(("valve_lag_s",), 0.020),
    "spool_leak": Hidden(("spool_leak_m2",), 2e-7),
    "exhaust_restriction": Hidden(("exhaust_restriction",), 0.5),
    "supply_droop": Hidden(("supply_resistance_pa_s_kg",), 5e7),
    "chamber_leak": Hidden(("chamber_a_leak_m2",), 3e-7),
    "piston_leak": Hidden(("piston_leak_m2",), 5e-7),
    "coulomb_friction": Hidden(("coulomb_n",), 60.0),
    "stiction": Hidden(("stiction_excess_n",), 60.0),
    "friction_asymmetry": Hidden(
        ("coulomb_asymmetry", "stiction_asymmetry", "viscous_asymmetry"),
        0.3,
        signed=True,
    ),
    "constant_force": Hidden(("constant_force_n",), 22.0, signed=True),
    "sensor_offset": Hidden(("pressure_a_offset_pa",), 30e3, signed=True),
    "valve_offset": Hidden(("valve_offset_v",), 0.2, signed=True),
    "valve_hysteresis": Hidden(("play_share",), 0.02),
    "valve_stuck_band": Hidden(("stuck_band_share",), 0.03),
    "valve_underlap": Hidden(("underlap_v",), 0.3),
    "supply_restriction": Hidden(("supply_restriction",), 0.5),
    "discharge_asymmetry": Hidden(("discharge_asymmetry",), 0.15, signed=True),
    "wall_heat": Hidden(("heat_transfer_w_m2_k",), 50.0),
    "viscous_friction": Hidden(("viscous_n_s_m",), 60.0),
    "spring_force": Hidden(("spring_n_m",), 120.0),
    "sensor_scale": Hidden(("position_scale",), 0.05, signed=True),
    "chamber_leak_b": Hidden(("chamber_b_leak_m2",), 3e-7),
    "quadratic_drag": Hidden(("quadratic_drag_n_s2_m2",), 400.0),
    "sagging_cable": Hidden(("sagging_cable_n",), 60.0),
    "sticky_spot": Hidden(("spot_drag_n_s_m",), 200.0),
    "magnetic_catch": Hidden(("catch_n",), 60.0),
    "sliding_leak": Hidden(("sliding_leak_m2_s_m",), 1e-6),
    "purge_flow": Hidden(("purge_kg_s",), 3e-4),
}
AT_A_SPOT = ("sticky_spot", "magnetic_catch")
OUTSIDE_CATALOGUE = ("quadratic_drag", "sagging_cable", *AT_A_SPOT, "sliding_leak", "purge_flow")
HIDDEN = tuple(name for name in EFFECTS if name not in OUTSIDE_CATALOGUE)
FIRST = HIDDEN[:12]  # those of the first test bench, which drew nothing below 15 %


def draw(hidden: str | None, seed: int) -> Case:
    """The case of this effect and seed, before the misfit rule (`misfit.scaled`).

    Raises KeyError for an unknown effect.
    """
    require_known(hidden, EFFECTS)
    rng = generator(hidden, seed, "draw")
    size, differences = draw_size(hidden, rng), _differences(hidden, rng)
    return Case(hidden, seed, size, differences, _accessories(hidden, rng))


def draw_size(hidden: str | None, rng: np.random.Generator) -> float:
    """As that of every plant, but an effect of the first test bench gets at least 15 %."""
    smallest = 0.15 if hidden in FIRST else SMALLEST_SHARE
    return drawn_size(EFFECTS, OUTSIDE_CATALOGUE, hidden, rng, smallest)


def _differences(hidden: str | None, rng: np.random.Generator) -> tuple[Difference, ...]:
    """Changes of all fields; a field whose size is the hidden one keeps exactly that size."""
    change = {
        name: 0.05 * getattr(NOMINAL, name) * rng.standard_normal()
        for name in (
            "moving_mass_kg",
            "dead_volume_a_m3",
            "dead_volume_b_m3",
            "flow_area",
            "spool_leak_m2",
            "heat_transfer_w_m2_k",
            "coulomb_n",
            "stiction_excess_n",
            "viscous_n_s_m",
        )
    }
    change["dead_zone_centre_v"] = 0.020 * rng.standard_normal()
    change["dead_zone_half_width_v"] = 0.020 * rng.standard_normal()
    change["supply_temperature_k"] = 2.0 * rng.standard_normal()
    change["ambient_pressure_pa"] = 100.0 * rng.standard_normal()
    supply = 0.02 * NOMINAL.supply_pressure_pa * rng.standard_normal()
    if hidden == "supply_droop":
        change["supply_pressure_pa"] = supply
    change["wall_k_per_j"] = 1 / rng.uniform(60.0, 200.0)
    change["valve_period_s"] = 1 / rng.uniform(80.0, 120.0)
    change["area_exponent"] = rng.uniform(1.4, 1.8) - NOMINAL.area_exponent
    change["friction_wave"] = rng.uniform(0.05, 0.10)
    change["pressure_lag_s"] = rng.uniform(1e-3, 2e-3)
    change["presliding_share"] = -rng.uniform(0.2, 0.4)
    return differences_of(change, EFFECTS, hidden)


def _accessories(hidden: str | None, rng: np.random.Generator) -> tuple[tuple[str, float], ...]:
    always = (
        ("valve_damping", float(rng.uniform(0.7, 1.0))),
        ("wall_loss_w_k", float(rng.uniform(0.3, 1.0))),
        ("friction_wavelength_m", float(rng.uniform(0.02, 0.10))),
        ("friction_phase_rad", float(rng.uniform(0, 2 * np.pi))),
    )
    if hidden not in AT_A_SPOT:
        return always
    spot = (float(rng.uniform(0.10, 0.19)), float(rng.uniform(0.02, 0.04)))
    return (*always, ("spot_m", spot[0]), ("spot_width_m", spot[1]))


def drive_of(
    case: Case,
    without: str = "",
    differences: tuple[Difference, ...] | None = None,
    beside: Case | None = None,
) -> Drive:
    """The true drive; `without` names a field whose difference is off, or "hidden".

    `differences` stand in place of the case's own; `beside` is a case whose hidden effect acts too.
    """
    if differences is not None:
        case = replace(case, differences=differences)
    changes = true_fields(case, NOMINAL, EFFECTS, without)
    if beside is not None and beside.hidden:
        changes.update(hidden_fields(EFFECTS, beside.hidden, beside.size))
    return replace(NOMINAL, **changes)

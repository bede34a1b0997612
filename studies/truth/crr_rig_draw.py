"""Random draws of a true `crr_rig`: one hidden effect and the small differences always on.

Source: physics.md 2.1 (nominal values), 6 (effects); sizes are typical ones of the catalogue.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from studies.truth.case import (
    Case,
    Difference,
    Hidden,
    differences_of,
    drawn_size,
    generator,
    require_known,
    true_fields,
)
from studies.truth.crr_rig import CrrRig

PLANT = "crr_rig"
NOMINAL = CrrRig()

EFFECTS = {
    "valve_dead_zone": Hidden(("dead_zone_half_width_v",), 0.6),
    "valve_lag": Hidden(("valve_lag_s",), 0.020),
    "supply_droop": Hidden(("supply_resistance_pa_s_kg",), 5e7),
    "chamber_leak": Hidden(("cap_leak_m2",), 3e-7),
    "piston_leak": Hidden(("piston_leak_m2",), 5e-7),
    "coulomb_friction": Hidden(("coulomb_n",), 60.0),
    "stiction": Hidden(("stiction_excess_n",), 60.0),
    "constant_force": Hidden(("constant_force_n",), 22.0, signed=True),
    "sensor_offset": Hidden(("cap_pressure_offset_pa",), 30e3, signed=True),
    "quadratic_drag": Hidden(("quadratic_drag_n_s2_m2",), 400.0),
}
OUTSIDE_CATALOGUE = ("quadratic_drag",)
HIDDEN = tuple(name for name in EFFECTS if name not in OUTSIDE_CATALOGUE)
draw_size = partial(drawn_size, EFFECTS, OUTSIDE_CATALOGUE)
STANDARD_DEVIATIONS = {
    **{
        name: 0.05 * getattr(NOMINAL, name)
        for name in (
            "moving_mass_kg",
            "cap_dead_volume_m3",
            "rod_dead_volume_m3",
            "flow_area",
            "clearance_m",
            "coulomb_n",
            "stiction_excess_n",
            "viscous_n_s_m",
        )
    },
    "underlap_v": 0.020,
    "centre_v": 0.020,
    "discharge_asymmetry": 0.020,
    "supply_temperature_k": 2.0,
    "ambient_pressure_pa": 100.0,
}


def draw(hidden: str | None, seed: int) -> Case:
    """The case of this effect and seed, before the misfit rule.

    Raises KeyError for an unknown effect.
    """
    require_known(hidden, EFFECTS)
    rng = generator(hidden, seed, f"{PLANT} draw")
    size, differences = draw_size(hidden, rng), _differences(hidden, rng)
    return Case(hidden, seed, size, differences, _accessories(rng), plant=PLANT)


def _differences(hidden: str | None, rng: np.random.Generator) -> tuple[Difference, ...]:
    """Changes of all fields; a field whose size is the hidden one keeps exactly that size."""
    change = {name: sd * rng.standard_normal() for name, sd in STANDARD_DEVIATIONS.items()}
    supply = 0.02 * NOMINAL.supply_pressure_pa * rng.standard_normal()
    if hidden == "supply_droop":  # the pressure is recorded otherwise
        change["supply_pressure_pa"] = supply
    change["heat_transfer_w_m2_k"] = rng.uniform(5.0, 20.0)
    change["wall_k_per_j"] = 1 / rng.uniform(30.0, 100.0)
    change["valve_period_s"] = 1 / rng.uniform(80.0, 120.0)
    change["hole_exponent"] = rng.uniform(0.95, 1.05) - NOMINAL.hole_exponent
    change["friction_wave"] = rng.uniform(0.05, 0.10)
    change["pressure_lag_s"] = rng.uniform(1e-3, 2e-3)
    change["smoothing_share"] = rng.uniform(0.5, 1.0)
    return differences_of(change, EFFECTS, hidden)


def _accessories(rng: np.random.Generator) -> tuple[tuple[str, float], ...]:
    return (
        ("valve_damping", float(rng.uniform(0.7, 1.0))),
        ("wall_loss_w_k", float(rng.uniform(0.2, 0.6))),
        ("friction_wavelength_m", float(rng.uniform(0.02, 0.08))),
        ("friction_phase_rad", float(rng.uniform(0, 2 * np.pi))),
    )


def rig_of(case: Case, without: str = "") -> CrrRig:
    """The true rig; `without` names a field whose difference is off, or "hidden"."""
    return replace(NOMINAL, **true_fields(case, NOMINAL, EFFECTS, without))

"""Random draws of a true bellows: one hidden effect and the small differences that are always on.

Source: physics.md 2.6 (nominal values), 6 (effects, and their ranges).
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
from studies.truth.soft_joint import SoftJoint

PLANT = "soft_joint"
NOMINAL = SoftJoint()
EFFECTS = {
    "valve_stuck_band": Hidden(("stuck_band_share",), 0.03),
    "chamber_leak": Hidden(("chamber_leak_m2",), 3e-7),
    "bellows_creep": Hidden(("creep_m3_pa",), 2e-10),
    "exhaust_restriction": Hidden(("exhaust_restriction",), 0.4),
    "supply_droop": Hidden(("supply_resistance_pa_s_kg",), 5e7),
    "sensor_offset": Hidden(("pressure_offset_pa",), 30e3, signed=True),
    "joint_motion": Hidden(("motion_share",), 0.15),
}
OUTSIDE_CATALOGUE = ("joint_motion",)
HIDDEN = tuple(name for name in EFFECTS if name not in OUTSIDE_CATALOGUE)
draw_size = partial(drawn_size, EFFECTS, OUTSIDE_CATALOGUE)


def draw(hidden: str | None, seed: int) -> Case:
    """The case of this effect and seed, before the misfit rule.

    Raises KeyError for an unknown effect.
    """
    require_known(hidden, EFFECTS)
    rng = generator(hidden, seed, "draw")
    size = draw_size(hidden, rng)
    return Case(hidden, seed, size, _differences(hidden, rng), _accessories(rng), plant=PLANT)


def _differences(hidden: str | None, rng: np.random.Generator) -> tuple[Difference, ...]:
    """Parameters off by their standard deviations, and richer physics by a little."""
    change = dict(
        volume_m3=0.05 * NOMINAL.volume_m3 * rng.standard_normal(),
        flow_area_m2=0.05 * NOMINAL.flow_area_m2 * rng.standard_normal(),
        overlap_share=0.002 * rng.standard_normal(),
        supply_temperature_k=2.0 * rng.standard_normal(),
        ambient_pressure_pa=100.0 * rng.standard_normal(),
        corner_share=NOMINAL.corner_share * rng.uniform(-0.15, 0.15),
        area_exponent=rng.uniform(-0.1, 0.1),
        thermal_share=rng.uniform(0.03, 0.10),
        stiffening_m3=NOMINAL.volume_m3 * rng.uniform(0.005, 0.02),
        creep_m3_pa=rng.uniform(2e-12, 1e-11),
        valve_period_s=1.0 / rng.uniform(80.0, 120.0),
        pressure_lag_s=rng.uniform(1e-3, 2e-3),
    )
    supply = 0.02 * NOMINAL.supply_pressure_pa * rng.standard_normal()
    if hidden == "supply_droop":  # the only case without a record of the supply
        change["supply_pressure_pa"] = supply
    return differences_of(change, EFFECTS, hidden)


def _accessories(rng: np.random.Generator) -> tuple[tuple[str, float], ...]:
    return (
        ("valve_damping", float(rng.uniform(0.6, 0.95))),
        ("heat_transfer_w_m2_k", float(rng.uniform(5.0, 20.0))),
        ("wall_j_per_k", float(rng.uniform(20.0, 80.0))),
        ("wall_loss_w_k", float(rng.uniform(0.3, 1.0))),
        ("stiffening_pa", float(rng.uniform(1e5, 3e5))),
        ("creep_time_s", float(rng.uniform(1.0, 8.0))),
        ("motion_hz", float(rng.uniform(0.8, 1.6))),
    )


def joint_of(case: Case, without: str = "") -> SoftJoint:
    """The true bellows; `without` names a field whose difference is off, or "hidden"."""
    return replace(NOMINAL, **true_fields(case, NOMINAL, EFFECTS, without))

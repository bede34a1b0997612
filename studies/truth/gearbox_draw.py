"""Random draws of a true gearbox: one hidden effect and the small differences that are always on.

Source: physics.md 2.5 (nominal values), 6 (effects, and their ranges).
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
from studies.truth.gearbox import Gearbox

PLANT = "gearbox"
NOMINAL = Gearbox()
EFFECTS = {
    "coulomb_friction": Hidden(("coulomb_main_n",), 60.0),
    "viscous_friction": Hidden(("viscous_main_n_s_m",), 60.0),
    "detent": Hidden(("detent_n",), 300.0),
    "synchroniser": Hidden(("synchroniser_n",), 1500.0),
    "command_delay": Hidden(("delay_1_s",), 0.015),
    "exhaust_restriction": Hidden(("exhaust_restriction_2",), 0.3),
    "quadratic_drag": Hidden(("quadratic_drag_n_s2_m2",), 400.0),
}
OUTSIDE_CATALOGUE = ("quadratic_drag",)
HIDDEN = tuple(name for name in EFFECTS if name not in OUTSIDE_CATALOGUE)
draw_size = partial(drawn_size, EFFECTS, OUTSIDE_CATALOGUE)
OFF_BY_A_TWENTIETH = (
    "main_kg",
    "floating_kg",
    "finger_kg_m2",
    "dead_volume_1_m3",
    "dead_volume_2_m3",
    "dead_volume_c_m3",
    "port_area_m2",
    "discharge_1",
    "discharge_2",
    "coil_1_ohm",
    "coil_2_ohm",
    "core_per_h",
    "spring_n_m",
    "preload_n",
    "heat_transfer_w_m2_k",
    "coulomb_main_n",
    "coulomb_floating_n",
    "coulomb_shank_n",
    "viscous_main_n_s_m",
    "viscous_floating_n_s_m",
    "detent_n",
)


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
    change = {f: 0.05 * getattr(NOMINAL, f) * rng.standard_normal() for f in OFF_BY_A_TWENTIETH}
    change["supply_voltage_v"] = rng.standard_normal()
    change["supply_temperature_k"] = 2.0 * rng.standard_normal()
    change["ambient_pressure_pa"] = 100.0 * rng.standard_normal()
    change["wall_k_per_j"] = 1.0 / rng.uniform(20.0, 80.0)
    change["saturation_per_a"] = 1.0 / rng.uniform(2.0, 4.0)
    change["friction_wave"] = rng.uniform(0.05, 0.10)
    change["algebraic_share"] = rng.uniform(0.5, 1.0)
    change["contact_n_m"] = NOMINAL.contact_n_m * rng.uniform(-0.3, 0.3)
    change["pressure_lag_s"] = rng.uniform(1e-3, 2e-3)
    return differences_of(change, EFFECTS, hidden)


def _accessories(rng: np.random.Generator) -> tuple[tuple[str, float], ...]:
    return (
        ("wall_loss_w_k", float(rng.uniform(0.1, 0.5))),
        ("friction_wavelength_m", float(rng.uniform(0.005, 0.02))),
        ("friction_phase_rad", float(rng.uniform(0, 2 * np.pi))),
        ("synchronising_s", float(rng.uniform(0.07, 0.14))),
    )


def gearbox_of(case: Case, without: str = "") -> Gearbox:
    """The true actuator; `without` names a field whose difference is off, or "hidden"."""
    return replace(NOMINAL, **true_fields(case, NOMINAL, EFFECTS, without))

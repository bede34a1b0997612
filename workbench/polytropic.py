"""A plant with less than the full gas balance: the gas temperature follows from the pressure.

For comparing with the papers' simplifications (physics.md 1.2, levels 2 and 3) and for design
models of fewer states; the full level of :mod:`workbench.gas_volume` stays the default.
"""

from __future__ import annotations

from dataclasses import replace

from workbench.gas_volume import GasVolume, PolytropicLevel
from workbench.plant import Plant


def with_polytropic_gas(plant: Plant, **law: float) -> Plant:
    """The plant with all its volumes polytropic; ``law`` names fields of the level.

    T_0 is each volume's initial temperature unless the law says otherwise.
    """

    def simplified(volume: GasVolume) -> GasVolume:
        values = {"reference_temperature_k": volume.initial_temperature_k, **law}
        return replace(volume, level=PolytropicLevel(**values))

    parts = (simplified(p) if isinstance(p, GasVolume) else p for p in plant.parts)
    return replace(plant, parts=tuple(parts))

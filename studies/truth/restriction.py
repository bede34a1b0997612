"""Flow functions of the truth as piecewise linear tables over the pressure ratio.

    mdot = area * table(p_down / p_up) * p_up / sqrt(T_up)

The tables hold psi times C_d C_chk for the valve paths and Psi for leaks. A look-up is several
times cheaper than powers in the inner loop; its relative error is below 2e-4 (test).

Source: physics.md 1.1 (ISO 6358-1:2013 with the laminar repair of E002-4, nozzle form) and 2.4.
"""

import numpy as np

from studies.truth.drive import CHOKED, DISCHARGE, GAS_CONSTANT_J_KG_K, KAPPA

CELLS = 40_000
SUPPLY_CRITICAL, EXHAUST_CRITICAL = 0.35, 0.30
CRACKING, SUBSONIC_INDEX, LAMINAR = 0.995, 0.52, 0.999


def iso6358(ratio, critical, cracking=CRACKING, index=SUBSONIC_INDEX):
    """Psi of ISO 6358-1:2013: one, elliptic, straight laminar zone, zero from `cracking` on."""
    laminar = min(LAMINAR * cracking, cracking - 1e-4)

    def elliptic(r):
        share = np.clip((r - critical) / (cracking - critical), 0.0, 1.0)
        return (1.0 - share**2) ** index

    straight = elliptic(laminar) * (cracking - ratio) / (cracking - laminar)
    return np.where(ratio < laminar, elliptic(ratio), np.maximum(straight, 0.0))


def nozzle(ratio):
    """Psi of an ideal nozzle, straight from ratio 0.999 to zero at 1."""

    def subsonic(r):
        gain = np.sqrt(2 * KAPPA / (GAS_CONSTANT_J_KG_K * (KAPPA - 1)))
        return gain * r ** (1 / KAPPA) * np.sqrt(1 - r ** ((KAPPA - 1) / KAPPA))

    edge = (2 / (KAPPA + 1)) ** (KAPPA / (KAPPA - 1))
    curved = np.where(ratio <= edge, CHOKED, subsonic(np.clip(ratio, edge, LAMINAR)))
    return np.where(ratio <= LAMINAR, curved, subsonic(LAMINAR) * (1 - ratio) / (1 - LAMINAR))


def tables() -> tuple[np.ndarray, np.ndarray]:
    """Intercept and slope of each cell for supply path, leak, exhaust path, one after another."""
    ratio = np.linspace(0.0, 1.0, CELLS + 1)
    curves = (
        DISCHARGE * CHOKED * iso6358(ratio, SUPPLY_CRITICAL),
        nozzle(ratio),
        DISCHARGE * CHOKED * iso6358(ratio, EXHAUST_CRITICAL),
    )
    slopes = [np.append(np.diff(c) * CELLS, 0.0) for c in curves]
    slopes = [np.where(np.arange(CELLS + 1) == CELLS, s[CELLS - 1], s) for s in slopes]
    intercepts = [c - s * ratio for c, s in zip(curves, slopes, strict=True)]
    return np.concatenate(intercepts), np.concatenate(slopes)


# Rows of the flow arrays, each (a, b): supply land, supply leak, exhaust land, exhaust leak,
# chamber leak, piston leak.  The number is the table each row reads.
ROW_TABLE = np.array([0, 1, 2, 1, 1, 1])
ROW_OFFSET = (ROW_TABLE * (CELLS + 1.0)).reshape(6, 1, 1)

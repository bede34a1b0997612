"""How much the loop of each mode bears at the plant's input: gain, phase, delay.

The loop is cut at the opening of the valve and taken at the real sample time: the sampled mode and
the law with its memory, without the limits and without the rest of the positioning task.

L(z) = -law(z) (z I - F)^-1 G
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf, pi, tau

import numpy as np

from controllers.scheduled import Schedule, driven_modes
from linearize.discrete import sampled
from linearize.modes import HybridModel, Mode

POINTS = 2000  # frequencies from far below the bandwidth to half the sampling rate
LOWEST_RAD_S = 0.1


@dataclass(frozen=True)
class Law:
    """The linear part of a controller, from a mode's states x to its opening u.

    s[k+1] = A s[k] + B x[k],   u[k] = C s[k] + D x[k]

    A, B, C, D       shapes (n_s, n_s), (n_s, 4), (n_s,) and (4,)
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray


@dataclass(frozen=True)
class Margins:
    """What may change at the plant's input before the loop of one mode becomes unstable.

    gain         factors down to and up to which the gain may go, 0 and inf where there is no end
    phase_rad    lag that may come on top
    delay_s      delay that may come on top
    distance     smallest distance of L from -1, 1/M_s of the textbooks
    stable       False where the loop is unstable as it is: the rest are crossings, no margins
    """

    mode: str
    gain: tuple[float, float]
    phase_rad: float
    delay_s: float
    distance: float
    stable: bool


def margins(hybrid: HybridModel, laws: Schedule[Law], sample_time_s: float) -> list[Margins]:
    """The margins of every driven mode with its own law, forward then backward."""
    pairs = zip(driven_modes(hybrid), (laws.forward, laws.backward), strict=True)
    return [
        margins_of(mode, law, sample_time_s)
        for modes, side in pairs
        for mode, law in zip(modes, side, strict=True)
    ]


def margins_of(mode: Mode, law: Law, sample_time_s: float) -> Margins:
    """The margins of one mode."""
    import control

    A, B, C = loop(mode, law, sample_time_s)
    system = control.ss(A, B, C, 0.0, sample_time_s)
    omega = np.geomspace(LOWEST_RAD_S, pi / sample_time_s, POINTS)
    values = system(np.exp(1j * omega * sample_time_s))
    response = control.frd(values, omega, smooth=True)
    gains, _, _, _, crossings, _ = control.stability_margins(response, returnall=True)
    if values[-1].real < 0.0:  # at half the sampling rate L ends on the real axis: a crossing too
        gains = [*gains, -1.0 / values[-1].real]
    phases = [np.angle(-complex(response(1j * w))) % tau for w in crossings]
    return Margins(
        mode=mode.name,
        gain=(_most(g for g in gains if g < 1.0), _least(g for g in gains if g > 1.0)),
        phase_rad=_least(min(phase, tau - phase) for phase in phases),
        delay_s=_least(phase / w for phase, w in zip(phases, crossings, strict=True)),
        distance=float(np.abs(1.0 + values).min()),
        stable=bool(np.abs(np.linalg.eigvals(A - B @ C)).max() < 1.0),
    )


def loop(mode: Mode, law: Law, sample_time_s: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A, B, C of L, the mode's states in units of their scale before those of the law."""
    small, n, m = sampled(mode, sample_time_s), len(mode.state_names), len(law.A)
    size = mode.scale
    A = np.block([[small.F * size / size[:, None], np.zeros((n, m))], [law.B * size, law.A]])
    B = np.concatenate([small.G[:, 0] / size, np.zeros(m)])[:, None]
    return A, B, -np.concatenate([law.D * size, law.C])[None, :]


def integral_of(feedback: np.ndarray, integral: float, sample_time_s: float) -> Law:
    """U = -K x - K_i (sum of the position error), the error of this sample included."""
    error = np.zeros(len(feedback))
    error[0] = sample_time_s
    return Law(
        A=np.eye(1), B=error[None, :], C=np.array([-integral]), D=-feedback - integral * error
    )


def _least(found: Iterable[float]) -> float:
    return float(min(found, default=inf))


def _most(found: Iterable[float]) -> float:
    return float(max(found, default=0.0))

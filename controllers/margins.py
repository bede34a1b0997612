"""How much the loop of each mode bears at the plant's input: gain, phase, delay, both at once.

The loop is cut at the opening of the valve and taken at the real sample time and with the real
delays: the sampled mode, the openings that are under way, and the law with its memory, without the
limits and without the rest of the positioning task.

L(z) = -law(z) (z I - F)^-1 (G_0 z^-n + G_1 z^-(n+1)),   delay = n T + rest

G_0 is what an opening does in the T - rest of a sample that is left when it arrives, G_1 the rest.
A law that foresees the delay of the commands is one of :mod:`controllers.foresight`.

What switches between laws is a closed loop in coordinates that do not jump with them.  An integral
I that a bumpless transfer sets anew does: what goes on is the opening before this sample's share of
it, r = I + direct(x).  Then A depends on the direct part of a law times the integral gain, and its
mixes lie between those of every direct part with every integral gain.

Source: K. J. Astrom and B. Wittenmark, "Computer-Controlled Systems", 3rd ed., Ch. 2 (delay);
P. Seiler, A. Packard and P. Gahinet, "An Introduction to Disk Margins", IEEE Control Systems
Magazine 40 (5) (2020) 78 (disk).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import inf, pi, tau

import numpy as np

from controllers.axis import Axis
from controllers.crossings import LoopResponse, negative_crossings, unit_crossings
from controllers.scheduled import Schedule, driven_modes
from linearize.discrete import sampled
from linearize.modes import HybridModel, Mode
from workbench.plant import Plant
from workbench.simulation import command_delay_s, output_delay_s

POINTS = 2000  # frequencies from far below the bandwidth to half the sampling rate
LOWEST_RAD_S = 0.1


@dataclass(frozen=True)
class Law:
    """The linear part of a controller, from a mode's states x to its opening u.

    s[k+1] = A s[k] + B x[k],   u[k] = C s[k] + D x[k]

    A, B, C, D       shapes (n_s, n_s), (n_s, 4), (n_s,) and (4,)
    bumpless         whether the last memory, an integral, is set at a change of law so that the
                     opening stays as it is
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    bumpless: bool = False


@dataclass(frozen=True)
class Margins:
    """What may change at the plant's input before the loop of one mode becomes unstable.

    gain         factors down to and up to which the gain may go, 0 and inf where there is no end
    phase_rad    smallest turn of L that ends at -1, a lag or a lead
    delay_s      delay that may come on top
    distance     smallest distance of L from -1, 1/M_s of the textbooks
    disk         size a of the balanced disk in which gain and phase may vary at once, 2 / |S - T|
    stable       False where the loop is unstable as it is: the rest are crossings, no margins
    """

    mode: str
    gain: tuple[float, float]
    phase_rad: float
    delay_s: float
    distance: float
    disk: float
    stable: bool

    @property
    def disk_gain(self) -> float:
        """Factor by which the gain may go up or down, together with the phase; inf for any."""
        return (2.0 + self.disk) / (2.0 - self.disk) if self.disk < 2.0 else inf

    @property
    def disk_phase_rad(self) -> float:
        """Lag or lead by which the phase may vary, together with the gain."""
        return 2.0 * float(np.arctan(self.disk / 2.0))


def margins(
    hybrid: HybridModel,
    laws: Schedule[Law],
    sample_time_s: float,
    delay_s: float = 0.0,
    axis: Axis | None = None,
) -> list[Margins]:
    """The margins of every driven mode with its own law, forward then backward."""
    pairs = zip(driven_modes(hybrid, axis), (laws.forward, laws.backward), strict=True)
    return [
        margins_of(mode, law, sample_time_s, delay_s)
        for modes, side in pairs
        for mode, law in zip(modes, side, strict=True)
    ]


def loops(
    hybrid: HybridModel,
    laws: Schedule[Law],
    sample_time_s: float,
    delay_s: float = 0.0,
    axis: Axis | None = None,
) -> dict[str, tuple[np.ndarray, ...]]:
    """Closed loops by driven mode: under its own law, then under those that are mixed into it.

    These are the laws of the same place and of both neighbours, for both directions of motion, and
    of bumpless ones the direct part of each with the integral gain of each.
    """
    sides, found = (laws.forward, laws.backward), {}
    for own, modes in enumerate(driven_modes(hybrid, axis)):
        for place, mode in enumerate(modes):
            near = slice(max(place - 1, 0), place + 2)
            mixed = _mixed([law for side in sides for law in side[near]], sides[own][place])
            found[mode.name] = tuple(
                closed(mode, law, sample_time_s, delay_s) for law in (sides[own][place], *mixed)
            )
    return found


def closed(mode: Mode, law: Law, sample_time_s: float, delay_s: float = 0.0) -> np.ndarray:
    """The closed loop x[k+1] = A x[k], shape (n, n), states as in :func:`loop`.

    The last memory of a bumpless law is r of the module instead.
    """
    A, B, C = loop(mode, law, sample_time_s, delay_s)
    if not law.bumpless:
        return A - B @ C
    goes_on = np.concatenate([(law.D - law.C[-1] * law.B[-1]) * mode.scale, law.C])
    T = np.eye(len(A))
    T[len(goes_on) - 1, : len(goes_on)] = goes_on
    return T @ (A - B @ C) @ np.linalg.inv(T)


def crossed(law: Law, other: Law) -> Law:
    """The direct part of one bumpless law with the integral gain of another."""
    gain = other.C[-1]
    direct = law.D + (gain - law.C[-1]) * law.B[-1]
    return replace(law, C=np.append(law.C[:-1], gain), D=direct)


def _mixed(laws: list[Law], own: Law) -> list[Law]:
    """What is mixed into a law: the others, or what they make with one another; each once."""
    if own.bumpless:
        laws = [crossed(law, other) for law in laws for other in laws]
    found = [own]
    for law in laws:
        if not any(_same(law, known) for known in found):
            found.append(law)
    return found[1:]


def _same(law: Law, other: Law) -> bool:
    return all(np.array_equal(getattr(law, k), getattr(other, k)) for k in "ABCD")


def unforeseen_s(plant: Plant) -> float:
    """Delay of the sensors: no estimator that looks ahead foresees it."""
    return output_delay_s(plant)


def both_ways_s(plant: Plant) -> float:
    """Delay of commands and sensors together, which a law on the raw measurement meets."""
    return unforeseen_s(plant) + command_delay_s(plant)


def margins_of(mode: Mode, law: Law, sample_time_s: float, delay_s: float = 0.0) -> Margins:
    """The margins of one mode, ``delay_s`` being in the loop already."""
    A, B, C = loop(mode, law, sample_time_s, delay_s)
    response = LoopResponse(A, B, C, sample_time_s)
    omega = np.geomspace(LOWEST_RAD_S, pi / sample_time_s, POINTS)
    values = response(omega)
    crossings = unit_crossings(response, omega, values)
    gains = [*(-1.0 / response(negative_crossings(response, omega, values)).real)]
    if values[-1].real < 0.0:  # at half the sampling rate L ends on the real axis: a crossing too
        gains.append(-1.0 / values[-1].real)
    phases = np.angle(-response(crossings)) % tau
    return Margins(
        mode=mode.name,
        gain=(_most(g for g in gains if g < 1.0), _least(g for g in gains if g > 1.0)),
        phase_rad=_least(min(phase, tau - phase) for phase in phases),
        delay_s=_least(phase / w for phase, w in zip(phases, crossings, strict=True)),
        distance=float(np.abs(1.0 + values).min()),
        disk=float((2.0 * np.abs(1.0 + values) / np.abs(1.0 - values)).min()),
        stable=bool(np.abs(np.linalg.eigvals(A - B @ C)).max() < 1.0),
    )


def loop(
    mode: Mode, law: Law, sample_time_s: float, delay_s: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A, B, C of L: the mode's states in units of their scale, those of the law, what is under way.

    What is under way are the openings of the last samples, oldest first.
    """
    F, direct, late = _delayed(mode, sample_time_s, delay_s)
    n, m, kept = len(F), len(law.A), len(late)
    size = mode.scale
    A = np.zeros((n + m + kept,) * 2)
    A[:n, :n], A[:n, n + m :] = F, late.T
    A[n : n + m, :n], A[n : n + m, n : n + m] = law.B * size, law.A
    A[n + m :, n + m :] = np.eye(kept, k=1)
    B = np.zeros((n + m + kept, 1))
    B[:n, 0] = direct
    if kept:
        B[-1] = 1.0
    return A, B, -np.concatenate([law.D * size, law.C, np.zeros(kept)])[None, :]


def _delayed(
    mode: Mode, sample_time_s: float, delay_s: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """F, the effect of this sample's opening, and those of the last ones, oldest first, scaled."""
    size, whole = mode.scale, sampled(mode, sample_time_s)
    F, G = whole.F * size / size[:, None], whole.G[:, 0] / size
    n = int(delay_s / sample_time_s + 1e-9)
    rest_s = delay_s - n * sample_time_s
    if rest_s < 1e-9 * sample_time_s:
        parts = [G]
    else:
        arrived = sampled(mode, sample_time_s - rest_s).G[:, 0] / size
        parts = [G - arrived, arrived]
    effects = np.array([*parts, *([np.zeros_like(G)] * n)])
    return F, effects[-1], effects[:-1]


def in_volts(law: Law) -> Law:
    """The same law whose last memory, an integral, goes on in volts where the laws change."""
    gain = law.C[-1]
    if gain == 0.0:
        return law
    B, C = law.B.copy(), law.C.copy()
    B[-1], C[-1] = gain * B[-1], 1.0
    return replace(law, B=B, C=C)


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

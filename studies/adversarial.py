"""Good recordings, spoiled on purpose: what is said of each, before anything is concluded from it.

``python -m studies.adversarial 1`` spoils the recordings of seed 1 of the hidden-effect study, made
by code other than the model's, in every way below, and prints one line for each; the unspoiled ones
stand first, and nothing should be said of them.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from studies.hidden_benches import SERVO_DRIVE as DRIVE
from studies.hidden_effects import recordings
from studies.truth.case import Case
from studies.truth.cases import read_cases
from workbench.consistency import examined
from workbench.recording import Recording
from workbench.rig import Rig

JITTER = 0.2  # of a sample

Spoil = Callable[[Recording], Recording]


def with_channels(recording: Recording, rows: Mapping[str, np.ndarray]) -> Recording:
    """The recording with these channels in the place of its own."""
    return replace(recording, channels={**recording.channels, **rows})


def exchanged(one: str, other: str) -> Spoil:
    """Two columns the wrong way round."""
    return lambda r: with_channels(r, {one: r[other], other: r[one]})


def scaled(factor: float, *names: str) -> Spoil:
    """A wrong unit."""
    return lambda r: with_channels(r, {name: factor * r[name] for name in names})


def shifted(by: float, *names: str) -> Spoil:
    """A wrong zero."""
    return lambda r: with_channels(r, {name: r[name] + by for name in names})


def turned(name: str, about: float = 0.0) -> Spoil:
    """A channel that counts the other way."""
    return lambda r: with_channels(r, {name: 2.0 * about - r[name]})


def stuck(name: str, from_s: float) -> Spoil:
    """A sensor that holds its value from some time on."""

    def spoiled(r: Recording) -> Recording:
        values, first = r[name].copy(), round(from_s / r.sample_time_s)
        values[first:] = values[first]
        return with_channels(r, {name: values})

    return spoiled


def noise(*names: str, memory: float = 0.0) -> Spoil:
    """Noise of the channel's own mean and size, white or with memory from sample to sample."""

    def spoiled(r: Recording) -> Recording:
        rng = np.random.default_rng(11)
        return with_channels(r, {name: _like(r[name], rng, memory) for name in names or r.channels})

    return spoiled


def _like(values: np.ndarray, rng: np.random.Generator, memory: float) -> np.ndarray:
    random = rng.standard_normal(len(values))
    for k in range(1, len(random) if memory else 0):
        random[k] += memory * random[k - 1]
    random = (random - random.mean()) / random.std()
    return np.nanmean(values) + np.nanstd(values) * random


def jittered(*names: str) -> Spoil:
    """Samples taken a fifth of a sample early or late, as a standard deviation."""

    def spoiled(r: Recording) -> Recording:
        ticks = np.arange(len(r), dtype=float)
        taken = ticks + JITTER * np.random.default_rng(12).standard_normal(len(r))
        return with_channels(r, {name: np.interp(taken, ticks, r[name]) for name in names})

    return spoiled


def played_backwards(command: str) -> Spoil:
    """The outputs of a recording with a command that was never played."""
    return lambda r: with_channels(r, {command: r[command][::-1]})


A, B = "chamber_a.pressure_pa", "chamber_b.pressure_pa"
PLACE, COMMAND = "slide.position_m", "valve.command_v"
SERVO_DRIVE: dict[str, Spoil] = {
    "as it is": lambda r: r,
    "pressures exchanged": exchanged(A, B),
    "a times 10": scaled(10.0, A),
    "a by 10": scaled(0.1, A),
    "both pressures by 10": scaled(0.1, A, B),
    "a in bar as Pa": scaled(1e-5, A),
    "both pressures in psi as kPa": scaled(1.0 / 6.894757, A, B),
    "position times 10": scaled(10.0, PLACE),
    "position by 10": scaled(0.1, PLACE),
    "position in m as mm": scaled(1e-3, PLACE),
    "position in m as cm": scaled(0.01, PLACE),
    "position in mm as m": scaled(1e3, PLACE),
    "command by 10": scaled(0.1, COMMAND),
    "a gauge as absolute": shifted(-1.013e5, A),
    "a and b gauge as absolute": shifted(-1.013e5, A, B),
    "position negative": turned(PLACE),
    "position mirrored": turned(PLACE, 0.145),
    "command mirrored": turned(COMMAND, 5.0),
    "position stuck after 3 s": stuck(PLACE, 3.0),
    "a stuck after 3 s": stuck(A, 3.0),
    "all noise": noise(),
    "a is noise": noise(A),
    "all slow noise": noise(memory=0.99),
    "clock jitter": jittered(A, B, PLACE),
    "another command": played_backwards(COMMAND),
}


def said(rig: Rig, recording: Recording) -> str:
    """All findings of one recording in a few words."""
    found = [
        f"{each.weight.value}: {each.channel} {each.what}" for each in examined(rig, recording)
    ]
    return " | ".join(found) or "nothing"


def lines(cases: Sequence[Case]) -> Iterator[str]:
    """What is said of the training recordings of some cases of the drive, spoiled in every way."""
    made = [train for train, _ in recordings(cases)]
    for name, spoil in SERVO_DRIVE.items():
        for case, train in zip(cases, made, strict=True):
            label = f"{name:<29}{case.hidden or 'nothing':<22}{case.seed:>2}"
            yield f"{label}  {said(DRIVE.user_rig(case), spoil(train))}"


if __name__ == "__main__":
    seeds = {int(seed) for seed in sys.argv[1:]} or {1}
    for line in lines([case for (_, seed), case in read_cases().items() if seed in seeds]):
        print(line, flush=True)

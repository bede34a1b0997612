"""Sensors whose noise a recording does not tell, where that takes them out of a fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.consistency.findings import Finding, Weight
from workbench.fitting.noise import measured_noise
from workbench.fitting.noise_source import NoiseSource, recorded_noise
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.units import display_unit, public_name, scale

MOST = 0.02  # of the range: a sensor that has more hardly counts beside others


def untold_noise(rig: Rig, recordings: Sequence[Recording]) -> list[Finding]:
    """Outputs whose motion passes for noise, because they are never still between two samples.

    A slow sensor that moves far from one sample to the next shows it.  A fit takes the noise from
    all its recordings together: a still piece of one tells it for the others.
    """
    found = []
    for recording in recordings:
        for name in _unclear(rig, recording):
            noise = _noise_of_all(recordings, name)
            share = noise / float(np.ptp(_seen(recording, name)))
            if share > MOST:
                found.append(_finding(recording, name, noise, share))
    return found


def _noise_of_all(recordings: Sequence[Recording], name: str) -> float:
    """The noise of an output as a fit takes it from those that have it."""
    return measured_noise([each for each in recordings if name in each.channels], [name])[name]


def _unclear(rig: Rig, recording: Recording) -> list[str]:
    """Outputs of which a recording alone tells no noise."""
    found = recorded_noise(recording, rig.fit_for(recording).measured).values()
    return [each.name for each in found if each.source is NoiseSource.UNCLEAR]


def _seen(recording: Recording, name: str) -> np.ndarray:
    values = recording[name]
    return values[np.isfinite(values)]


def _finding(recording: Recording, name: str, noise: float, share: float) -> Finding:
    shown = scale(display_unit(name), name).from_si(noise)
    return Finding(
        Weight.NOTICE,
        recording.source or recording.name,
        public_name(name),
        "its noise cannot be told, since it is never still: differences of its samples tell "
        f"{shown:.3g} {display_unit(name)}, {share:.0%} of its range, and so it hardly "
        "counts in a fit",
        "if you know its noise, give noise = ... for the channel in [recording]",
    )

"""Sensors whose noise a recording does not tell, where that takes them out of a fit."""

from __future__ import annotations

import numpy as np

from workbench.consistency.findings import Finding, Weight
from workbench.fitting.noise_source import Noise, NoiseSource, recorded_noise
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.units import display_unit, public_name, scale

MOST = 0.02  # of the range: a sensor that has more hardly counts beside others


def untold_noise(rig: Rig, recording: Recording) -> list[Finding]:
    """Outputs whose motion passes for noise, because they are never still between two samples.

    A slow sensor that moves far from one sample to the next shows it.
    """
    found = recorded_noise(recording, rig.fit_for(recording).measured).values()
    told = ((each, _share(recording, each)) for each in found)
    return [_finding(recording, each, share) for each, share in told if share > MOST]


def _share(recording: Recording, noise: Noise) -> float:
    """What of the range of an output its noise is, 0 where it is known."""
    if noise.source is not NoiseSource.UNCLEAR:
        return 0.0
    values = recording[noise.name]
    return noise.value / float(np.nanmax(values) - np.nanmin(values))


def _finding(recording: Recording, noise: Noise, share: float) -> Finding:
    shown = scale(display_unit(noise.name), noise.name).from_si(noise.value)
    return Finding(
        Weight.NOTICE,
        recording.source or recording.name,
        public_name(noise.name),
        "its noise cannot be told, since it is never still: differences of its samples tell "
        f"{shown:.3g} {display_unit(noise.name)}, {share:.0%} of its range, and so it hardly "
        "counts in a fit",
        "if you know its noise, give noise = ... for the channel in [recording]",
    )

"""How what was identified stands to what the rig believed: far off, or at the end of its range.

A value many prior deviations off is right where the rig was wrong, and wrong where a recording of
another rig was given, or a tank of another volume: neither shows in its own standard deviation.  At
the end of its range a value is no result, and its deviation says nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isnan, nan

from workbench.diagnosis.judge import LEAST_SIZE
from workbench.identification.estimate import Estimate, end_reached, says_nothing
from workbench.rig import Rig

FAR = 5.0  # prior deviations


@dataclass(frozen=True)
class Standing:
    """One identified parameter.

    Attributes
    ----------
    deviations_off
        Distance from the rig's value in prior standard deviations, at least 0; NaN where the rig
        has none.
    end
        The end of its range, in SI, at or beyond which it lies; NaN where it lies within.
    none
        Whether that end is where nothing of it is there, which may be so.
    silent
        Whether the recordings say nothing of it.
    """

    deviations_off: float
    end: float
    none: bool = False
    silent: bool = False

    @property
    def at_bound(self) -> bool:
        """True where it lies at an end of its range, or beyond."""
        return not isnan(self.end)

    @property
    def far(self) -> bool:
        """True where it lies further from the rig's value than such a rig is believed to be off."""
        return self.deviations_off > FAR


def standing(rig: Rig, found: Estimate) -> Standing:
    """How a parameter of the rig, named in full, stands to the rig's own value and its range."""
    known, prior = rig.plant.parameters[found.name], rig.standard_deviation(found.name)
    if prior > 0.0 and known.null is not None and found.name not in rig.deviations:
        prior = max(prior, LEAST_SIZE * abs(known.typical))  # nothing to know of a weaker one
    off = abs(found.value - rig.plant.values[found.name]) / prior if prior > 0.0 else nan
    end = end_reached(known, found.value)
    silent = says_nothing(known, found, rig.standard_deviation(found.name))
    return Standing(off, end, end == known.null, silent)

"""How what was identified stands to what the rig believed: far off, or at the end of its range.

A value many prior deviations off is right where the rig was wrong, and wrong where a recording of
another rig was given, or a tank of another volume: neither shows in its own standard deviation.  At
the end of its range a value is no result, and its deviation says nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isnan, nan

from workbench.diagnosis.judge import LEAST_SIZE
from workbench.effect import Parameter
from workbench.identification.result import Estimate
from workbench.rig import Rig

FAR = 5.0  # prior deviations
AT_BOUND = 1e-3  # of the range, or of the typical size where that is smaller: solvers stop before


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
    """

    deviations_off: float
    end: float

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
    return Standing(off, end_reached(known, found.value))


def end_reached(known: Parameter, value: float) -> float:
    """The end of a parameter's range that a value in SI has come to or passed, else NaN."""
    room = AT_BOUND * min(known.upper - known.lower, abs(known.typical) or inf)
    if value <= known.lower + room:
        return known.lower
    return known.upper if value >= known.upper - room else nan

"""What an identification procedure gives, and how a rig takes it over."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from workbench.errors import InputError, Message
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.units import public_name


@dataclass(frozen=True)
class Estimate:
    """A number that was identified, in SI; its name ends in its unit."""

    name: str
    value: float
    deviation: float


def estimated(
    names: Iterable[str], values: Iterable[float], deviations: Iterable[float]
) -> tuple[Estimate, ...]:
    """Estimates from columns."""
    rows = zip(names, values, deviations, strict=True)
    return tuple(Estimate(name, float(value), float(spread)) for name, value, spread in rows)


@dataclass(frozen=True, kw_only=True)
class Curve:
    """What was measured and what was fitted over a common axis, each of shape (n,)."""

    label: str
    along: np.ndarray
    measured: np.ndarray
    fitted: np.ndarray

    @property
    def residual(self) -> np.ndarray:
        """Measured minus fitted."""
        return self.measured - self.fitted

    @property
    def mean_absolute_error(self) -> float:
        """MAE, in the unit of what was measured."""
        return float(np.mean(np.abs(self.residual)))


@dataclass(frozen=True, kw_only=True)
class Identified:
    """What a procedure found.

    Attributes
    ----------
    rig
        The rig as it came.
    estimates
        What the paper prints for this procedure.
    parameters
        Values of the rig's own parameters, by full name.
    curves
        Measured and fitted, with the residuals.
    """

    rig: Rig
    estimates: tuple[Estimate, ...]
    parameters: tuple[Estimate, ...]
    curves: tuple[Curve, ...]

    def __getitem__(self, name: str) -> Estimate:
        found = {each.name: each for each in (*self.estimates, *self.parameters)}
        if name not in found:
            raise KeyError(f"no {name} was identified; there are {', '.join(found)}")
        return found[name]

    def improved(self) -> Rig:
        """The rig with what was found, and its standard deviations; the rest stays.

        A value beyond the range of its parameter is taken at the end of the range.  A cause that
        the rig file removed is back where its strength was identified.
        """
        plant = self.rig.plant
        known = plant.parameters
        values = {
            each.name: min(max(each.value, known[each.name].lower), known[each.name].upper)
            for each in self.parameters
        }
        deviations = {e.name: e.deviation for e in self.parameters if isfinite(e.deviation)}
        strengths = {name: c.strength for name, c in plant.candidates.items()}
        return replace(
            self.rig,
            plant=plant.with_values(values),
            removed=tuple(name for name in self.rig.removed if strengths[name] not in values),
            deviations={**self.rig.deviations, **deviations},
        )


@dataclass(frozen=True, kw_only=True)
class Procedure:
    """A guided fit: what it gives, the recording it needs, and the function that does it.

    The function takes a rig and its recordings, and raises InputError where a recording is of
    another kind.
    """

    name: str
    gives: str
    manoeuvre: str
    source: str
    run: Callable[[Rig, Sequence[Recording]], Identified]


def complete(recordings: Iterable[Recording]) -> None:
    """Refuse recordings with missing samples: the procedures average and count neighbours.

    Raises
    ------
    InputError
        With every channel that misses some, and the time of the first.
    """
    messages = [
        Message(
            f"{public_name(name)} misses {missing.sum()} of {len(missing)} samples, the first at "
            f"{each.sample_time_s * int(missing.argmax()):.4g} s",
            expected="a recording without holes",
            file=each.source or each.name,
        )
        for each in recordings
        for name, missing in ((n, ~np.isfinite(v)) for n, v in each.channels.items())
        if missing.any()
    ]
    if messages:
        raise InputError(*messages)


def unfit(recording: Recording, what: str, expected: str) -> InputError:
    """The complaint about a recording of another kind, with the file it came from."""
    return InputError(Message(what, expected=expected, file=recording.source or recording.name))

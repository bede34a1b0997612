"""What an identification procedure gives, and how a rig takes it over."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite

import numpy as np

from workbench.errors import InputError, Message, listed
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
    """What was measured and what was fitted over a common axis, each of shape (n,).

    ``at_bound`` names the curve's own values that ended at the end of their range.
    """

    label: str
    along: np.ndarray
    measured: np.ndarray
    fitted: np.ndarray
    at_bound: tuple[str, ...] = ()

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
    carried
        What an earlier procedure found and these values rely on: it goes along into another rig.
    """

    rig: Rig
    estimates: tuple[Estimate, ...]
    parameters: tuple[Estimate, ...]
    curves: tuple[Curve, ...]
    carried: tuple[Estimate, ...] = ()

    def __getitem__(self, name: str) -> Estimate:
        found = {each.name: each for each in (*self.estimates, *self.parameters)}
        if name not in found:
            raise KeyError(f"no {name} was identified; there are {', '.join(found)}")
        return found[name]

    def improved(self, into: Rig | None = None, note: str = "") -> Rig:
        """The rig with what was found, and its standard deviations; the rest stays.

        ``into`` is another rig that has parameters of the same names, such as the drive whose valve
        was measured on a tank.  A parameter that a rig fixes keeps its value.  A value beyond the
        range of its parameter is taken at the end of the range, and a note says so.  A cause that
        the rig file removed is back where its strength was identified.

        Raises
        ------
        InputError
            If the other rig has none of the parameters.
        """
        rig = self.rig if into is None else into
        known = rig.plant.parameters
        every = (*self.parameters, *(self.carried if into else ()))
        taken = [e for e in every if e.name in known and e.name not in rig.fixed]
        if not taken:
            names = listed(public_name(each.name) for each in self.parameters)
            raise InputError(Message("takes none of what was identified", rig.name, names))
        values = {
            e.name: min(max(e.value, known[e.name].lower), known[e.name].upper) for e in taken
        }
        beyond = [
            f"{public_name(e.name)} stands at the end of its range: identified was a value beyond"
            for e in taken
            if values[e.name] != e.value
        ]
        deviations = {e.name: e.deviation for e in taken if isfinite(e.deviation)}
        strengths = {name: c.strength for name, c in rig.plant.candidates.items()}
        return replace(
            rig,
            plant=rig.plant.with_values(values),
            removed=tuple(name for name in rig.removed if strengths[name] not in values),
            deviations={**rig.deviations, **deviations},
            notes=_with_notes(rig.notes, *(self._earlier if into else ()), *beyond, note),
        )

    @property
    def _earlier(self) -> list[str]:
        """What the rig says of where the carried values come from."""
        names = [public_name(each.name) for each in self.carried]
        return [note for note in self.rig.notes if any(name in note for name in names)]


@dataclass(frozen=True, kw_only=True)
class Procedure:
    """A guided fit: what it gives, the recording it needs, and the function that does it.

    Attributes
    ----------
    manoeuvre, channels
        What to do, and what to record of it.
    first
        The procedure whose result must stand in the rig beforehand; none where empty.
    example
        The command, behind ``workbench identify``.
    printed
        What paper 002 prints of its own drive, in SI by the name of an estimate or a parameter.
    run
        (rig, recordings) -> what was found; raises InputError where a recording is of another
        kind, or what must be known before is not.
    """

    name: str
    gives: str
    manoeuvre: str
    channels: str
    first: str = ""
    example: str
    source: str
    printed: Mapping[str, float] = field(default_factory=dict)
    run: Callable[[Rig, Sequence[Recording]], Identified]

    def note(self, found: Identified, recordings: Sequence[Recording]) -> str:
        """One line for the rig file: which values, from which recordings, by which method."""
        names = listed(public_name(each.name) for each in found.parameters)
        read = listed((each.name for each in recordings), most=3)
        return f"{self.name} identified {names} from {read}; {self.source}"


def _with_notes(notes: tuple[str, ...], *new: str) -> tuple[str, ...]:
    """The notes and new ones, each in place of what the same procedure said before."""
    for note in filter(None, new):
        begins = " ".join(note.split()[:2])
        notes = (*(each for each in notes if not each.startswith(begins)), note)
    return notes


def known_before(rig: Rig, names: Iterable[str], first: str, why: str) -> None:
    """Refuse a rig that does not say how well an earlier result is known.

    A rig says so by a standard deviation of its own, or by fixing the parameter.

    Raises
    ------
    InputError
        With the parameters, and the procedure that finds them.
    """
    missing = [public_name(n) for n in names if n not in rig.deviations and n not in rig.fixed]
    if missing:
        what = f"{why}, and the rig does not say how well it knows {listed(missing)}"
        expected = (
            f"the rig that `workbench identify {first}` writes with -o, or these in [uncertainty]"
        )
        raise InputError(Message(what, rig.name, expected))


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

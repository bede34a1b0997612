"""What an identification procedure gives, and how a rig takes it over."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite, nan

import numpy as np

from workbench.errors import InputError, Message, listed
from workbench.identification.estimate import Estimate, at_end, says_nothing
from workbench.identification.notes import begins_with, kept_note, with_notes
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.units import public_name


@dataclass(frozen=True, kw_only=True)
class Curve:
    """What was measured and what was fitted over a common axis, each of shape (n,).

    ``at_bound`` names the curve's own values that ended at the end of their range.  ``noise`` is
    the standard deviation of what was measured, NaN where the curve cannot be that close.
    """

    label: str
    along: np.ndarray
    measured: np.ndarray
    fitted: np.ndarray
    at_bound: tuple[str, ...] = ()
    noise: float = nan

    @property
    def misfit(self) -> float:
        """RMS of the residual in deviations of the noise, NaN where it cannot be one."""
        return float(np.sqrt(np.mean(self.residual**2))) / self.noise

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
    doubts
        Sentences on what the recordings say against these values.
    """

    rig: Rig
    estimates: tuple[Estimate, ...]
    parameters: tuple[Estimate, ...]
    curves: tuple[Curve, ...]
    carried: tuple[Estimate, ...] = ()
    doubts: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Estimate:
        found = {each.name: each for each in (*self.estimates, *self.parameters)}
        if name not in found:
            raise KeyError(f"no {name} was identified; there are {', '.join(found)}")
        return found[name]

    def beside(self, rig: Rig) -> tuple[Estimate, ...]:
        """What goes into a rig along with the parameters; into another one what was carried."""
        return () if rig is self.rig else self.carried

    def taken(self, into: Rig | None = None) -> tuple[Estimate, ...]:
        """The parameters that a rig takes over: that it has, does not fix, and that are results."""
        rig = self.rig if into is None else into
        return tuple(e for e in _there(rig, self.parameters) if not why_left(rig, e))

    def left(self, into: Rig | None = None) -> dict[str, str]:
        """Parameters of which a rig keeps its own value, by full name, and why."""
        rig = self.rig if into is None else into
        why = {e.name: why_left(rig, e) for e in _there(rig, self.parameters)}
        return {name: said for name, said in why.items() if said}

    def improved(self, into: Rig | None = None, note: str = "") -> Rig:
        """The rig with what was found, and its standard deviations; the rest stays.

        ``into`` is another rig that has parameters of the same names, such as the drive whose valve
        was measured on a tank.  A parameter that a rig fixes keeps its value.  So does one whose
        identified value ended at the end of its range, or says less than the rig knew: a note says
        so.  A cause that the rig file removed is back where its strength was identified.

        Raises
        ------
        InputError
            If the other rig has none of the parameters.
        """
        rig = self.rig if into is None else into
        if not _there(rig, self.parameters):
            names = listed(public_name(each.name) for each in self.parameters)
            raise InputError(Message("takes none of what was identified", rig.name, names))
        known = rig.plant.parameters
        taken = (*self.taken(into), *_there(rig, self.beside(rig)))
        values = {
            e.name: min(max(e.value, known[e.name].lower), known[e.name].upper) for e in taken
        }
        deviations = {e.name: e.deviation for e in taken if isfinite(e.deviation)}
        strengths = {name: c.strength for name, c in rig.plant.candidates.items()}
        said = [kept_note(name, why) for name, why in self.left(into).items()]
        notes = [each for each in rig.notes if not begins_with(each, values)]
        return replace(
            rig,
            plant=rig.plant.with_values(values),
            removed=tuple(name for name in rig.removed if strengths[name] not in values),
            deviations={**rig.deviations, **deviations},
            notes=with_notes(notes, *(self._earlier if into else ()), *said, note),
        )

    @property
    def _earlier(self) -> list[str]:
        """What the rig says of where the carried values come from."""
        names = [public_name(each.name) for each in self.carried]
        return [note for note in self.rig.notes if any(name in note for name in names)]


def _there(rig: Rig, found: Iterable[Estimate]) -> list[Estimate]:
    """What a rig has a place for and does not fix."""
    return [e for e in found if e.name in rig.plant.parameters and e.name not in rig.fixed]


def why_left(rig: Rig, found: Estimate) -> str:
    """Why a rig keeps its own value, or nothing."""
    known = rig.plant.parameters[found.name]
    if at_end(known, found.value):
        return "what was identified stands at the end of its range"
    if says_nothing(known, found, rig.standard_deviation(found.name)):
        return "the recordings say nothing of it"
    return ""


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

    def note(
        self, found: Identified, recordings: Sequence[Recording], into: Rig | None = None
    ) -> str:
        """One line for the rig file: which values it takes, from which recordings, by what method.

        Nothing where the rig takes none of them.
        """
        names = ", ".join(public_name(each.name) for each in found.taken(into))
        read = listed((each.name for each in recordings), most=3)
        return f"{self.name} identified {names} from {read}; {self.source}" if names else ""


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

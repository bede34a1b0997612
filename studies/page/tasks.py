"""What jobs of the page do: the verbs of the package, and what must be looked up for pictures.

Each takes a function for progress as its last argument, and gives values that are small enough to
travel: a diagnosis with all its fits is not.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import workbench
from studies.page.drivers import Driver, Regimes, drivers_of, regime_errors
from studies.page.plausibility import Finding, findings_of, gate_of
from studies.text_of_results import (
    ADDED,
    FITTED,
    addition_text,
    diagnosis_text,
    fit_text,
    unit_names,
)
from workbench.comparison.compare import Comparison
from workbench.comparison.independence import Independence, independence_of
from workbench.diagnosis.located import Where
from workbench.diagnosis.result import NextRecording, Ranked, Verdict
from workbench.fitting.errors import Errors
from workbench.fitting.posterior import Moved
from workbench.reading import enough_samples
from workbench.recording import Recording
from workbench.rig import Rig

Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Opened:
    """A recording as its file was read, and what was found of it."""

    path: str
    recording: Recording = field(repr=False)
    findings: tuple[Finding, ...]


@dataclass(frozen=True, eq=False)
class Compared:
    """A comparison, and for each of its recordings what it is looked at against.

    ``independence`` is that of the one-step error of each output, by recording.
    """

    comparison: Comparison = field(repr=False)
    drivers: tuple[tuple[Driver, ...], ...] = field(repr=False)
    independence: tuple[Mapping[str, Independence], ...] = field(repr=False)
    regimes: tuple[Regimes, ...] = field(repr=False)


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """A diagnosis without its fits; ``text`` is what the command line prints.

    ``terms`` hold the missing term of every balance by its name, the worst first.
    """

    verdict: Verdict
    sentence: str
    ranking: tuple[Ranked, ...] = field(repr=False)
    where: Where | None = field(repr=False)
    terms: Mapping[str, Where] = field(repr=False)
    next_recording: NextRecording | None = field(repr=False)
    warnings: tuple[str, ...]
    text: str = field(repr=False)


@dataclass(frozen=True, eq=False)
class Accepted:
    """A rig after one effect was added, or a fit, without its fits; see ``Addition``.

    ``words`` say what its errors are before and after.
    """

    name: str
    rig: Rig
    before: Errors = field(repr=False)
    after: Errors = field(repr=False)
    parameters: tuple[Moved, ...] = field(repr=False)
    text: str = field(repr=False)
    words: tuple[str, str] = ADDED


def open_recordings(rig: Rig, paths: Sequence[str], say: Say) -> tuple[Opened, ...]:
    """Recordings of a rig, with what is plausible in them and what is not."""
    found = []
    for path in paths:
        say(f"reading {path}")
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            recording = workbench.read_recording(rig, path)
        said = tuple(str(each.message) for each in told)
        found.append(Opened(path, recording, findings_of(rig, Path(path), recording, said)))
    return tuple(found)


def check_gate(rig: Rig, train: Sequence[Recording], say: Say) -> tuple[Finding, ...]:
    """Whether recordings can be fitted: excitation, saturation, contradiction, identifiability."""
    say("excitation, saturation, identifiability")
    return gate_of(rig, train)


def compare(rig: Rig, recordings: Sequence[Recording], say: Say) -> Compared:
    """The verb, and what its residuals are looked at against."""
    say("comparing: one step, windows, free run")
    found = workbench.compare(rig, recordings)
    say("residual tests")
    pairs = tuple(zip(recordings, found.recordings, strict=True))
    return Compared(
        found,
        tuple(drivers_of(rig, each) for each in recordings),
        tuple(independence_of(rig, each, told) for each, told in pairs),
        tuple(regime_errors(rig, each, told) for each, told in pairs),
    )


def diagnose(
    rig: Rig, train: Sequence[Recording], validation: Sequence[Recording], say: Say
) -> Diagnosed:
    """The verb; the ranking comes without its fits."""
    enough_samples(rig, train)
    found = workbench.diagnose(rig, train, validation, say)
    from studies.page.balance_terms import terms_of

    say("the missing term of every balance")
    terms = terms_of(rig, found.base, found.where) if found.where else {}
    units = unit_names(rig.plant.measured + rig.plant.optional_outputs)
    return Diagnosed(
        found.verdict,
        found.sentence,
        tuple(replace(row, fit=None, validation=None) for row in found.ranking),
        found.where,
        terms,
        found.next_recording,
        found.warnings,
        diagnosis_text(found, units),
    )


def add(
    rig: Rig, name: str, train: Sequence[Recording], validation: Sequence[Recording], say: Say
) -> Accepted:
    """The verb."""
    enough_samples(rig, train)
    found = workbench.add(rig, name, train, validation, say)
    told = addition_text(found, unit_names(rig.plant.measured))
    text = f"{found.rig.notes[-1]}\n{told}"
    return Accepted(name, found.rig, found.before, found.after, found.parameters, text)


def fit(
    rig: Rig, train: Sequence[Recording], validation: Sequence[Recording], say: Say
) -> Accepted:
    """The verb."""
    enough_samples(rig, train)
    found = workbench.fit(rig, train, validation, progress=say)
    moved = tuple(
        Moved(row.name, row.prior, row.value, row.deviation, row.prior_deviation)
        for row in found.rows
    )
    text = fit_text(found, unit_names(rig.plant.measured))
    return Accepted("fit", found.rig, found.before, found.after, moved, text, FITTED)

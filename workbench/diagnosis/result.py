"""What a diagnosis says: frozen values that the command line prints and the report draws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from workbench.candidate import Candidate
from workbench.diagnosis.located import Where
from workbench.diagnosis.size import Size
from workbench.diagnosis.warned import Warned
from workbench.effect import Kind
from workbench.fitting.errors import SignalError
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.posterior import Moved
from workbench.manoeuvres.conduct import Conduct
from workbench.recording import Recording


class Verdict(Enum):
    """The answer in one word (interface.md section 4)."""

    FOUND = "found"
    SMALL_PROXY = "small_proxy"
    TIE = "tie"
    NOTHING_MISSING = "nothing_missing"
    NOT_IN_CATALOGUE = "not_in_catalogue"
    RECORDING_TOO_WEAK = "recording_too_weak"


BLIND = 1.0  # typical sizes: what is not seen there is not seen
NAMING = (Verdict.FOUND, Verdict.TIE, Verdict.SMALL_PROXY)


class Evidence(Enum):
    """What a held-out error is of: anything but another recording proves little."""

    VALIDATION = "validation"
    LAST_THIRD = "the last third of the training recordings"
    REPEATED = "validation that repeats a training recording"
    FEW = "validation of no more than a few slow decays"

    @property
    def strong(self) -> bool:
        """True where it may prove something."""
        return self is Evidence.VALIDATION


class DecidedBy(Enum):
    """How far a candidate was followed."""

    SCAN = "scan"
    REFIT = "refit"
    NOT_APPLICABLE = "not applicable"


def told(share: float) -> float:
    """A share of a misfit as it is told: an error that falls below the noise is all of it."""
    return min(share, 1.0)


def percent_told(share: float) -> str:
    """A share of a misfit in words: all of it only where no tenth of a percent is left."""
    whole = told(share)
    return f"{whole:.1%}" if 0.99 <= whole < 0.9995 else f"{whole:.0%}"


@dataclass(frozen=True)
class Ranked:
    """One row of the ranking.

    Attributes
    ----------
    size
        Strength and forms by full parameter name; empty where the scan alone decided.
    drop_train, drop_validation
        Share of the squared error beyond noise (:mod:`workbench.fitting.beyond_noise`) that goes
        away, weighed by noise and by the typical errors of the model without it
        (:mod:`workbench.fitting.error_model`).  Where the scan decided, what the linear model says
        of all windows, and NaN for the second.
    tied_with
        Public names of the candidates that cannot be told apart from it here.
    imitated_by
        Of all that do the same: the share of its effect on this recording that each would explain,
        were it the truth.
    compensable
        Share of its effect on this recording that the fitted parameters can imitate.
    accepted, reasons
        Whether it passes every criterion of diagnosis.md 1.6, and why not in words.
    drop_wide, modification_index
        Share of the misfit that the scan sees go with priors thrice as wide, and the fall of chi2
        that its smallest size promises; NaN if not asked.
    plain_validation, plain_chance
        Held-out squared error over that of the prior fit, no window capped, NaN without; standard
        deviation of its logarithm by chance among windows.
    visible_from
        Size in typical sizes from which this recording would show it; NaN where that is not known.
    crowd
        Of the leader: those beyond the printed tie that cannot be told apart from it either.
    rig_value
        Of a shift: what the rig says of the parameter that it moves, the first of ``size``; else
        NaN.
    fit, validation
        The refit and the same plant on the held-out recordings; None where it was not followed.
    """

    candidate: Candidate
    kind: Kind
    size: Mapping[str, Size]
    drop_train: float
    drop_validation: float
    tied_with: tuple[str, ...]
    compensable: float
    decided_by: DecidedBy
    accepted: bool
    reasons: tuple[str, ...]
    plain_validation: float = float("nan")
    plain_chance: float = 0.0
    visible_from: float = float("nan")
    crowd: tuple[str, ...] = ()
    imitated_by: Mapping[str, float] = field(default_factory=dict)
    drop_wide: float = float("nan")
    modification_index: float = float("nan")
    rig_value: float = float("nan")
    fit: Fit | None = field(default=None, repr=False)
    validation: Fit | None = field(default=None, repr=False)

    @property
    def alike(self) -> tuple[str, ...]:
        """All that cannot be told apart from it, in the printed tie and beyond."""
        return (*self.tied_with, *self.crowd)

    @property
    def blind(self) -> bool:
        """True where the recording would not show the candidate in its typical size."""
        return self.visible_from > BLIND


@dataclass(frozen=True)
class LawTerm:
    """One term on top of those before it: fit, held-out fit, and the shares that it removes."""

    candidate: Candidate
    fit: Fit = field(repr=False)
    validation: Fit | None = field(repr=False)
    drop_train: float
    drop_validation: float


@dataclass(frozen=True)
class Law:
    """An empirical law for a balance that no effect of the catalogue explains.

    ``balances`` are those of its terms; ``terms`` coefficients by full parameter name; ``ranges``
    those of all measured outputs and speeds in which it was seen; ``steps`` its terms one after the
    other; ``fit`` and ``validation`` as of a refit.  It is not a physical effect.
    """

    balances: tuple[str, ...]
    terms: Mapping[str, Size]
    ranges: Mapping[str, tuple[float, float]]
    drop_train: float
    drop_validation: float
    text: str
    steps: tuple[LawTerm, ...] = ()
    fit: Fit | None = field(default=None, repr=False)
    validation: Fit | None = field(default=None, repr=False)


@dataclass(frozen=True)
class NextRecording:
    """What to record so that rivals can be told apart.

    Attributes
    ----------
    what
        What a person does.
    separates
        The rivals, the likeliest first; ``nothing`` is the model as it is.
    expected_gain
        Chi2 by which the right rival should then be better than any other that is not alike, NaN
        where nothing can be played.  Errors count by their size in the recordings so far: where the
        manoeuvre goes further than those and more is missing there, errors grow and less is gained.
    alike
        Pairs of rivals that it does not tell apart either.
    predicted, commands
        What each rival would record, by its name; the commands of the first are to be played.
    reference
        What a position loop is to follow, by output, (n,) in SI; empty where commands are played as
        they are.
    noise
        Standard deviation of the sensor noise by output, in SI.
    conduct
        Where it starts, the stops that it meets, and the loop; None where nothing can be played.
    """

    what: str
    separates: tuple[str, ...]
    expected_gain: float
    alike: tuple[tuple[str, str], ...] = ()
    predicted: Mapping[str, Recording] = field(default_factory=dict, repr=False)
    commands: tuple[str, ...] = ()
    reference: Mapping[str, np.ndarray] = field(default_factory=dict, repr=False)
    noise: Mapping[str, float] = field(default_factory=dict)
    conduct: Conduct | None = field(default=None, repr=False)


@dataclass(frozen=True)
class Diagnosis:
    """One round of diagnosis; see interface.md section 4 for its JSON.

    ``before`` and ``after`` map ``train`` and ``validation`` to errors by public output name.
    ``after`` belongs to what the verdict names, an effect or a law, and is empty without.
    ``base`` is the prior fit without any addition, ``base_validation`` the same on held-out data.
    ``evidence`` says what that data is worth.
    ``next_recording`` is there where the verdict leaves a question open.
    ``contradicted`` is True where recording and rig contradict each other, or hardly anything was
    fitted (``too_short``): whatever the ranking accepts then is no effect to be added.
    ``strained`` are parameters that the prior fit takes far from what is known of them: suspects.
    """

    rig_name: str
    verdict: Verdict
    sentence: str
    ranking: tuple[Ranked, ...]
    where: Where | None
    before: Mapping[str, Mapping[str, SignalError]]
    after: Mapping[str, Mapping[str, SignalError]]
    law: Law | None
    warned: tuple[Warned, ...]
    base: Fit = field(repr=False)
    base_validation: Fit | None = field(repr=False)
    next_recording: NextRecording | None = None
    evidence: Evidence = Evidence.VALIDATION
    contradicted: bool = False
    too_short: bool = False
    strained: tuple[Moved, ...] = ()

    @property
    def warnings(self) -> tuple[str, ...]:
        """What it warns of, in words."""
        return tuple(each.text for each in self.warned)

    @property
    def named(self) -> Ranked | None:
        """The first row of the ranking where the verdict speaks of it."""
        return self.ranking[0] if self.ranking and self.verdict in NAMING else None

    @property
    def best(self) -> Ranked | None:
        """The first row of the ranking where it passes every criterion and the verdict names it."""
        return self.named if self.verdict is not Verdict.SMALL_PROXY else None

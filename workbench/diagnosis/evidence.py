"""What is held out of a fit, and what that proves.

Held-out must be another manoeuvre (diagnosis.md 1.6).  Where there is none the last third of each
recording stands in, and whatever is said of it says so.
"""

from __future__ import annotations

from collections.abc import Sequence

from workbench.diagnosis.judge import too_few
from workbench.diagnosis.result import Evidence
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.problem import NO_EVIDENCE, proves_nothing, split
from workbench.recording import Recording

WARNINGS = {
    Evidence.LAST_THIRD: "no validation recording: the last third is held out, which is weak "
    "evidence",
    Evidence.REPEATED: NO_EVIDENCE,
    Evidence.FEW: "what is held out is no more than a few slow decays, which is weak evidence",
}

Recordings = Sequence[Recording]


def held_out(train: Recordings, validation: Recordings) -> tuple[Recordings, Recordings, Evidence]:
    """(recordings to train on, to hold out, what the latter prove)."""
    if not validation:
        return *split(train), Evidence.LAST_THIRD
    repeated = proves_nothing(train, validation)
    return train, validation, Evidence.REPEATED if repeated else Evidence.VALIDATION


def weighed(evidence: Evidence, found: Fit | None) -> Evidence:
    """The same, once the fit on what is held out shows how much there is of it."""
    return Evidence.FEW if evidence.strong and too_few(found) else evidence

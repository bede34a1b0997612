"""The missing term of every balance, as the diagnosis finds that of the worst one.

:func:`workbench.diagnosis.where.locate` follows the balance that gains most; here each of the
others gets its own smoother, at the intensity that is likeliest for it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.diagnosis.dependence import dependences, imitated, parameter_columns
from workbench.diagnosis.drivers import drivers
from workbench.diagnosis.located import Where
from workbench.diagnosis.missing_term import Course
from workbench.diagnosis.suspects import Suspect, suspects, wandering, with_missing_flows
from workbench.filter_likelihoods import log_likelihoods
from workbench.filter_passes import recording_filter, smooth
from workbench.fitting.gauss_newton import Fit
from workbench.plant import Plant
from workbench.plant_filter import PlantFilter
from workbench.recording import Recording, joined
from workbench.rig import Rig


def terms_of(rig: Rig, base: Fit, worst: Where) -> dict[str, Where]:
    """The missing term of each balance by its name, the worst first.

    Parameters
    ----------
    base
        The prior fit of a diagnosis of the rig.
    worst
        What the diagnosis found of the balance that gains most.
    """
    if worst.course is None:  # of a bench without states there is one
        return {worst.balance: worst}
    recording = joined(base.windows.recordings)
    plant, flows = with_missing_flows(rig.fit_for(base.windows.recordings[0]).lean())
    astray = wandering(plant, base.windows)
    noise = dict(zip(plant.measured, base.windows.noise, strict=True))
    step_s = float(worst.time_s[1] - worst.time_s[0])
    decimate = max(round(step_s / recording.sample_time_s), 1)
    found = {worst.balance: worst}
    for each in suspects(plant, flows, recording, astray):
        if each.balance in found or each.balance not in worst.by_balance:
            continue
        unknown = {each.parameter: each.intensities[0]}
        lacking = recording_filter(plant, recording, unknown, noise, astray.process, decimate)
        found[each.balance] = _term(plant, base, recording, each, lacking, worst)
    return found


def _term(
    plant: Plant,
    base: Fit,
    recording: Recording,
    suspect: Suspect,
    lacking: PlantFilter,
    worst: Where,
) -> Where:
    """The smoothed term of one balance, and what it follows."""
    factors = np.array([suspect.intensities]) / suspect.intensities[0]
    gains = log_likelihoods(lacking, recording, factors)
    likeliest = int(np.argmax(np.where(np.isfinite(gains), gains, -np.inf)))
    result = smooth(lacking, recording, float(factors[0, likeliest]))
    of = worst.course
    course = Course(suspect.state, suspect.parameter, result.states, of.commands, of.measured)
    term = result.unknown[0]
    rest = term - imitated(term, parameter_columns(plant, base.unknowns, course))
    return replace(
        worst,
        balance=suspect.balance,
        term_name=suspect.term,
        term=term,
        term_deviation=result.unknown_deviation[0],
        against=dependences(drivers(plant, course, result.time_s), {}, rest, rest),
        intensities=None,
        rest=rest,
        course=course,
        imitated=max(1.0 - float(rest.var() / term.var()), 0.0) if term.any() else 0.0,
        by_law=False,
    )

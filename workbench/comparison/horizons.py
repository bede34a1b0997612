"""What a plant foretells of a recording, over three horizons, because positions integrate.

one step    innovations of the extended Kalman filter: what is missed within one sample; where that
            is worse than a free run, of a filter that corrects what is measured alone; else with
            less process noise as long as that is likelier, so that of a plant that is right
            innovations are little more than noise
window      short stretches with free start states, as a fit has them
            (:mod:`workbench.fitting.window_length`): forces and flows stay visible, drift is cut
free run    the whole recording from its first sample: what a user of a simulation feels

A plant without states has one horizon, ``sample by sample``.

A filter through impacts is too sure of what nothing measures: on a gearbox the errors of a landing
went into its shut control chamber, to 3 bar where there was 1, and threw the floating piston a
hundred samples later.

Source: diagnosis.md 1.1; Schmidt 1966, "Application of state-space methods to navigation problems",
for what is considered and not corrected; Kristensen, Madsen and Jorgensen 2004, for process noise
by its likelihood.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from workbench.comparison.course import Course
from workbench.filter_passes import FilterResult, filter_pass, recording_filter
from workbench.fitting.errors import in_units
from workbench.fitting.start_states import refit_starts
from workbench.fitting.window_length import window_length_s
from workbench.fitting.windows import TooShortError, Windows, cut_windows, window_firsts
from workbench.plant import Plant
from workbench.plant_filter import PlantFilter
from workbench.recording import Recording
from workbench.simulation import simulate

ONE_STEP, WINDOW, FREE_RUN, PLAIN = "one step", "window", "free run", "sample by sample"
JUDGED = (WINDOW, PLAIN, FREE_RUN, ONE_STEP)  # the first there is tells where the error is
PROCESS_SHARE = 0.1  # of a state's scale per square root of a second, in the one-step filter
SMALLER_SHARES = (0.1, 0.01, 1e-3)  # of that, which a plant that is right is likelier with
FARTHER = 1.5  # times the squared error of a free run
UNEXPECTED = 4.0  # times the variance that the filter expects of its own innovations
ASTRAY = "one step: the filter is further off than a free run: it has lost the state"

Rows = Mapping[str, np.ndarray]


def foretold(course: Course, noise: Mapping[str, float]) -> tuple[dict[str, Rows], list[str]]:
    """Outputs (n,) by horizon and full name, NaN where nothing; and what could not be done."""
    plant, recording = course.plant, course.recording
    if not plant.model.states:
        return {PLAIN: _outputs(plant, simulate(plant, recording))}, []
    free, notes = None, []
    try:
        free = _free_run(course)
    except ArithmeticError as error:
        notes.append(f"no free run: {error}")
    filtered, unsaid = _followed(course, noise, free)
    found, paths = {ONE_STEP: _one_step(recording, filtered)}, [filtered.states]
    notes += [*lost(recording, found[ONE_STEP]), *unsaid]
    if free:
        paths.append(np.array([free[name] for name in plant.model.states]))
    try:
        windows = cut_windows(plant, [recording], noise, window_length_s(plant, [recording]))
    except TooShortError as error:
        notes.append(f"no windows: {error}")
    else:
        found[WINDOW], unsaid = _windows(windows, paths)
        notes += [*unsaid, *_thinned(windows)]
    if free:
        found[FREE_RUN] = {name: free[name] for name in plant.measured}
    return found, notes


def _thinned(windows: Windows) -> list[str]:
    """In words how many windows of a long recording are run, if not all of them."""
    (recording,) = windows.recordings
    there = len(window_firsts(recording, windows.length))
    run = len(windows)
    return [f"windows: {run} of {there} are run, evenly over the recording"] if run < there else []


def lost(recording: Recording, ahead: Rows) -> list[str]:
    """From when on the one-step filter gave no numbers, in words."""
    recorded = np.isfinite(recording.rows(ahead)).any(axis=0)
    missing = recorded & ~np.isfinite([*ahead.values()]).any(axis=0)
    told = _where(missing, recorded, recording.sample_time_s)
    return [f"one step: the filter gave nothing for {told}"] if told else []


def _where(missing: np.ndarray, recorded: np.ndarray, sample_time_s: float) -> str:
    """How many of the recorded samples are missing, and from when on; both (n,)."""
    if not missing.any():
        return ""
    share, start_s = missing.sum() / recorded.sum(), sample_time_s * np.argmax(missing)
    return f"{100 * share:.3g} % of the samples, the first at {start_s:.4g} s"


def _outputs(plant: Plant, recording: Recording) -> Rows:
    return {name: recording[name] for name in plant.measured}


def _followed(
    course: Course, noise: Mapping[str, float], free: Rows | None
) -> tuple[FilterResult, list[str]]:
    """The filter over the recording, and in words where the careful one goes astray too."""
    recording, known = course.recording, _filter(course, noise)
    filtered = filter_pass(known, recording, course.states)
    if not free or not _astray(recording, filtered, free):
        return _surer(course, known, filtered), []
    careful = replace(known, considered=beside_measured(course.plant))
    if (careful.corrected != known.corrected).any():
        other = filter_pass(careful, recording, course.states)
        filtered = max(filtered, other, key=_likely)
    return filtered, [ASTRAY] if _astray(recording, filtered, free) else []


def _surer(course: Course, known: PlantFilter, filtered: FilterResult) -> FilterResult:
    """What a filter gives with ever less process noise, as long as likelihood rises."""
    for share in SMALLER_SHARES:
        process = {name: share * noise for name, noise in known.process_noise.items()}
        tried = replace(known, process_noise=process)
        passed = filter_pass(tried, course.recording, course.states)
        if not _likely(passed) > _likely(filtered):
            break
        filtered = passed
    return filtered


def beside_measured(plant: Plant) -> tuple[str, ...]:
    """The states of all members of which no state is measured."""
    seen = {name.rpartition(".")[0] for name in plant.measured}
    return tuple(name for name in plant.model.states if name.rpartition(".")[0] not in seen)


def _astray(recording: Recording, filtered: FilterResult, free: Rows) -> bool:
    """True where an output is foretold worse from the sample before than from the first one.

    And far worse than the filter itself expects: what follows the noise of a good sensor is a
    little further off than a free run of a plant that is right.
    """
    rows = zip(filtered.measured, filtered.innovations, filtered.normalised, strict=True)
    for name, innovation, normalised in rows:
        both = np.isfinite(innovation) & np.isfinite(recording[name] - free[name])
        missed = recording[name][both] - free[name][both]
        farther = np.sum(innovation[both] ** 2) > FARTHER * np.sum(missed**2)
        if farther and np.sum(normalised[both] ** 2) > UNEXPECTED * both.sum():
            return True
    return False


def _likely(filtered: FilterResult) -> float:
    likely = filtered.log_likelihood
    return likely if np.isfinite(likely) else -np.inf


def _filter(course: Course, noise: Mapping[str, float]) -> PlantFilter:
    """The filter of a recording.

    It starts where the recording is: from the plant's own initial state a link or a stop
    would be strained, and a gas mass known no better than its scale becomes any temperature.
    """
    plant, recording = course.plant, course.recording
    return recording_filter(
        plant,
        recording,
        measurement_noise=noise,
        process_noise=dict(zip(plant.model.states, PROCESS_SHARE * plant.scale, strict=True)),
        initial_deviation=dict(zip(plant.model.states, course.deviations[:, 0], strict=True)),
    )


def _one_step(recording: Recording, found: FilterResult) -> Rows:
    """Measured minus innovation: the outputs foretold one sample before."""
    rows = zip(found.measured, found.innovations, strict=True)
    return {name: recording[name] - innovation for name, innovation in rows}


def _windows(windows: Windows, paths: Sequence[np.ndarray]) -> tuple[Rows, list[str]]:
    """Outputs of each window from its own start, and what could not be simulated in words.

    Outputs (n,) are NaN outside of windows, and where a window could not be simulated.

    ``paths`` are states along the recording, (n_x, n) each, where a window may begin to look for
    its start: then it is no worse than a free run is there.
    """
    recording, firsts = windows.recordings[0], windows.firsts[0]
    begun = [path[:, list(firsts)] for path in paths]
    begun = [np.where(np.isfinite(each), each, windows.start) for each in begun]
    fit = refit_starts(windows, others=begun)
    simulated = windows.measured - in_units(fit)
    simulated[fit.unsimulated] = np.nan
    rows = np.full((len(simulated), len(recording)), np.nan)
    lost, recorded = np.zeros((2, len(recording)), dtype=bool)
    for k, first in enumerate(firsts):
        here = slice(first, first + windows.length)
        rows[:, here] = simulated[:, k]
        lost[here] = fit.unsimulated[:, k].any(axis=0)
        recorded[here] = np.isfinite(windows.measured[:, k]).any(axis=0)
    told = _where(lost, recorded, recording.sample_time_s)
    notes = [f"window: could not be simulated for {told}"] if told else []
    return dict(zip(windows.plant.measured, rows, strict=True)), notes


def _free_run(course: Course) -> Rows:
    """States and outputs from the first sample of each piece to its end, (n,) by full name."""
    plant, recording = course.plant, course.recording
    pieces = [
        simulate(plant, piece, course.states[:, first])
        for first, piece in zip(recording.starts, recording.pieces, strict=True)
    ]
    names = dict.fromkeys((*plant.model.states, *plant.measured))
    return {name: np.concatenate([piece[name] for piece in pieces]) for name in names}

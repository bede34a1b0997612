"""Where a model fails: the missing flow of each balance, from an unknown-input smoother.

A random walk is added to one balance at a time, at *prior* parameters: a deterministic fit would
spread a valve or leak error into mass and damping and move the blame (diagnosis.md 4.3).  The gain
of log-likelihood over the filter without it, at the best of a few intensities, names the balance;
the smoothed walk, in N or kg/s, against the variables that drive it shows what is missing
(:mod:`workbench.diagnosis.dependence`).  Where no sensor was heard for a while the walk goes on as
it likes: that is told of nowhere.

Heat enters a pressure as a flow of gas does, and only the mass tells them apart, which nobody
measures: the energy balance of a gas is named where it gains clearly more than its mass balance.

Source: diagnosis.md 1.3; Kristensen, Madsen and Jorgensen 2004 (significant diffusion terms).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

import numpy as np

from workbench.candidate import Candidate
from workbench.comparison.regimes import regime_shares
from workbench.diagnosis.dependence import (
    dependences,
    direction,
    imitated,
    parameter_columns,
    side,
)
from workbench.diagnosis.drivers import drivers
from workbench.diagnosis.located import Where
from workbench.diagnosis.missing_term import Course, Intensities
from workbench.diagnosis.suspects import Suspect, suspects, wandering, with_missing_flows
from workbench.effect import Balance
from workbench.filter_likelihoods import log_likelihoods
from workbench.filter_passes import FilterResult, recording_filter, smooth
from workbench.fitting.problem import Problem
from workbench.fitting.window_length import moves
from workbench.plant import Plant
from workbench.plant_filter import PlantFilter
from workbench.recording import Recording, joined
from workbench.simulation import inputs

GRID_S = 5e-3  # of the filter
LONGEST = 2000  # steps of the filter where nothing does
UNHEARD = 20  # steps of the filter without any output, on either side: there nothing is known
CLEARLY_MORE = 1.05  # times the gain of the mass balance
INTO_GAS = (Balance.VALVE, Balance.FLOW, Balance.MASS, Balance.ENERGY, Balance.SUPPLY)


def locate(
    problem: Problem, recordings: Sequence[Recording], among: Collection[str] = ()
) -> Where | None:
    """Log-likelihood gain of each balance, and the missing flow of the one that gains most.

    All recordings are followed one after the other.  With ``among`` the one is sought among these
    balances, which an empirical law names.  None for a plant without states, or where no filter run
    stayed finite or met a sample, or none of these balances can be followed.
    """
    plant, flows = with_missing_flows(problem.whole.lean())
    windows, recording = problem.base.windows, joined(recordings)
    astray = wandering(plant, windows)
    suspected = suspects(plant, flows, recording, astray) if flows else []
    if not suspected:
        return None
    noise = dict(zip(plant.measured, windows.noise, strict=True))
    decimate = max(round(_grid_s(plant, recording) / recording.sample_time_s), 1)

    def lacking(unknown: dict[str, float]) -> PlantFilter:
        return recording_filter(plant, recording, unknown, noise, astray.process, decimate)

    gains = _gains(suspected, lacking, recording)
    asked = {s: by for s, by in gains.items() if not among or s.balance in among}
    if not asked:
        return None
    worst = _worst(asked)
    likeliest = max(gains[worst], key=lambda q: gains[worst][q])
    neighbour = _neighbour(gains[worst], likeliest)
    filters = lacking({worst.parameter: likeliest})
    result, other = (smooth(filters, recording, q / likeliest) for q in (likeliest, neighbour))
    heard = result.watched(UNHEARD)
    if not heard.any():
        return None
    term, softer = (each.unknown[0, heard] for each in (result, other))
    time_s, course = result.time_s[heard], _course(plant, recording, result, decimate, worst)
    course = course.part(heard)
    columns = parameter_columns(plant, problem.base.unknowns, course)
    rest, rest_other = (d - imitated(d, columns) for d in (term, softer))
    followed = drivers(plant, course, time_s)
    return Where(
        balance=worst.balance,
        by_balance={s.balance: max(0.0, *by.values()) for s, by in gains.items()},
        term_name=worst.term,
        time_s=time_s,
        term=term,
        term_deviation=result.unknown_deviation[0, heard],
        against=dependences(followed, _directions(plant, worst, followed), rest, rest_other),
        by_regime=regime_shares(problem.base),
        intensities=Intensities(likeliest, neighbour, softer),
        imitated=max(1.0 - float(rest.var() / term.var()), 0.0) if term.any() else 0.0,
        by_law=bool(among),
        rest=rest,
        course=course,
    )


def _neighbour(tried: Iterable[float], likeliest: float) -> float:
    """The next lower intensity that was followed; of the lowest the next higher one, if any."""
    tried = sorted(tried)
    return tried[min(abs(tried.index(likeliest) - 1), len(tried) - 1)]


def _grid_s(plant: Plant, recording: Recording) -> float:
    """Step of the filter: what moves is followed closely, what rests for minutes more coarsely."""
    length_s = len(recording) * recording.sample_time_s
    return GRID_S if moves(plant) else max(GRID_S, length_s / LONGEST)


def _worst(gains: Mapping[Suspect, Mapping[float, float]]) -> Suspect:
    """The balance that gains most; heat only where it gains clearly more than the gas."""
    named = {suspect.balance: max(by.values()) for suspect, by in gains.items()}
    heat, gas = f".{Balance.ENERGY.value}", f".{Balance.MASS.value}"

    def counted(suspect: Suspect) -> float:
        gain = named[suspect.balance]
        rival = named.get(suspect.balance.removesuffix(heat) + gas)
        hidden = suspect.balance.endswith(heat) and rival and gain < CLEARLY_MORE * rival
        return -np.inf if hidden else gain

    return max(gains, key=counted)


def acts_in(candidate: Candidate, balance: str) -> bool:
    """True where a cause enters a balance, as :attr:`Where.balance` names it.

    What acts on flows shows in the gas of every chamber, and what acts in one chamber only there.
    A force is carried on to every body, through stops, levers and links.
    """
    place, _, kind = balance.rpartition(".")
    own = candidate.cause.balance
    if kind == Balance.MOMENTUM.value:
        return own is Balance.MOMENTUM
    return own in INTO_GAS and candidate.place in (None, place)


def _gains(
    suspected: list[Suspect],
    lacking: Callable[[dict[str, float]], PlantFilter],
    recording: Recording,
) -> dict[Suspect, dict[float, float]]:
    """Log-likelihood that each suspect gains over a model without it, by intensity.

    An intensity whose run was lost is left out.
    """
    trials = [(s, q) for s in suspected for q in s.intensities]
    known = lacking({s.parameter: s.intensities[0] for s in suspected})
    factors = [[q / each.intensities[0] * (s is each) for s, q in trials] for each in suspected]
    plain, *likely = log_likelihoods(known, recording, np.pad(factors, ((0, 0), (1, 0))))
    gains: dict[Suspect, dict[float, float]] = {}
    for (suspect, q), gain in zip(trials, likely - plain, strict=True):
        if np.isfinite(gain):
            gains.setdefault(suspect, {})[q] = float(gain)
    return gains


def _course(
    plant: Plant, recording: Recording, result: FilterResult, decimate: int, suspect: Suspect
) -> Course:
    """Smoothed states, commands and measured inputs at each sample of the filter."""
    used = [(inputs(plant, piece), len(piece) // decimate * decimate) for piece in recording.pieces]
    u, d = (np.hstack([both[k][:, : max(n, 1) : decimate] for both, n in used]) for k in (0, 1))
    return Course(suspect.state, suspect.parameter, result.states, u, d)


def _directions(
    plant: Plant, suspect: Suspect, followed: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Ways by which a term is split: of the body of its balance, and of each command."""
    place = suspect.balance.rpartition(".")[0]
    bodies = [place, *(getattr(p, "body", None) for p in plant.parts if p.name == place)]
    found = {
        name: side(values)
        for name, values in followed.items()
        if name.partition(".velocity_")[0] in bodies and ".velocity_" in name
    }
    return found | {name: direction(followed[name]) for name in plant.model.commands}

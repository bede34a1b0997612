"""Where a model fails: the missing flow of each balance, from an unknown-input smoother.

A random walk is added to one balance at a time, at *prior* parameters: a deterministic fit would
spread a valve or leak error into mass and damping and move the blame (diagnosis.md 4.3).  The gain
of log-likelihood over the filter without it, at the best of a few intensities, names the balance;
the smoothed walk, in N or kg/s, against the variables that drive it shows what is missing.

Heat enters a pressure as a flow of gas does, and only the mass tells them apart, which nobody
measures: the energy balance of a gas is named where it gains clearly more than its mass balance.

Source: diagnosis.md 1.3; Kristensen, Madsen and Jorgensen 2004 (significant diffusion terms).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from workbench.candidate import Candidate
from workbench.comparison.regimes import regime_shares
from workbench.diagnosis.result import Dependence, Where
from workbench.diagnosis.suspects import Suspect, suspects, wandering, with_missing_flows
from workbench.effect import Balance
from workbench.filter_passes import FilterResult, log_likelihoods, recording_filter, smooth
from workbench.fitting.problem import Problem
from workbench.fitting.window_length import moves
from workbench.plant import Plant
from workbench.plant_filter import PlantFilter
from workbench.recording import Recording

GRID_S = 5e-3  # of the filter
LONGEST = 2000  # steps of the filter where nothing does
CLEARLY_MORE = 1.05  # times the gain of the mass balance
BINS = 15
INTO_GAS = (Balance.VALVE, Balance.FLOW, Balance.MASS, Balance.ENERGY, Balance.SUPPLY)


def locate(problem: Problem, recordings: Sequence[Recording]) -> Where | None:
    """Log-likelihood gain of each balance, and the missing flow of the one that gains most.

    None for a plant without states, or where no filter run stayed finite.
    """
    plant, flows = with_missing_flows(problem.whole.lean())
    windows, recording = problem.base.windows, recordings[0]
    astray = wandering(plant, windows)
    suspected = suspects(plant, flows, recording, astray) if flows else []
    if not suspected:
        return None
    noise = dict(zip(plant.measured, windows.noise, strict=True))
    decimate = max(round(_grid_s(plant, recording) / recording.sample_time_s), 1)

    def lacking(unknown: dict[str, float]) -> PlantFilter:
        return recording_filter(plant, recording, unknown, noise, astray.process, decimate)

    gains = _gains(suspected, lacking, recording)
    if not gains:
        return None
    worst = _worst(gains)
    result = smooth(lacking({worst.parameter: gains[worst][1]}), recording)
    term = result.unknown[0]
    return Where(
        balance=worst.balance,
        by_balance={s.balance: gain for s, (gain, _) in gains.items()},
        term_name=worst.term,
        time_s=result.time_s,
        term=term,
        term_deviation=result.unknown_deviation[0],
        against=_dependences(plant, recording, result, term, decimate),
        by_regime=regime_shares(problem.base),
    )


def _grid_s(plant: Plant, recording: Recording) -> float:
    """Step of the filter: what moves is followed closely, what rests for minutes more coarsely."""
    length_s = len(recording) * recording.sample_time_s
    return GRID_S if moves(plant) else max(GRID_S, length_s / LONGEST)


def _worst(gains: Mapping[Suspect, tuple[float, float]]) -> Suspect:
    """The balance that gains most; heat only where it gains clearly more than the gas."""
    named = {suspect.balance: gain for suspect, (gain, _) in gains.items()}
    heat, gas = f".{Balance.ENERGY.value}", f".{Balance.MASS.value}"

    def counted(suspect: Suspect) -> float:
        gain = named[suspect.balance]
        rival = named.get(suspect.balance.removesuffix(heat) + gas)
        hidden = suspect.balance.endswith(heat) and rival and gain < CLEARLY_MORE * rival
        return -np.inf if hidden else gain

    return max(gains, key=counted)


def acts_in(candidate: Candidate, balance: str) -> bool:
    """True where a cause enters a balance, as :attr:`Where.balance` names it.

    What acts on flows shows in the gas of every chamber, and what acts in one place only there.
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
) -> dict[Suspect, tuple[float, float]]:
    """Log-likelihood that each suspect gains over a model without it, and at which intensity."""
    trials = [(s, q) for s in suspected for q in s.intensities]
    known = lacking({s.parameter: s.intensities[0] for s in suspected})
    factors = [[q / each.intensities[0] * (s is each) for s, q in trials] for each in suspected]
    plain, *likely = log_likelihoods(known, recording, np.pad(factors, ((0, 0), (1, 0))))
    gains: dict[Suspect, tuple[float, float]] = {}
    for (suspect, q), gain in zip(trials, likely - plain, strict=True):
        if np.isfinite(gain) and gain > gains.get(suspect, (-np.inf, q))[0]:
            gains[suspect] = float(gain), q
    return gains


def _dependences(
    plant: Plant, recording: Recording, result: FilterResult, term: np.ndarray, decimate: int
) -> tuple[Dependence, ...]:
    """Correlation ratio of the term with each driving variable, strongest first."""
    n = len(term)
    drivers = dict(zip(result.state_names, result.states, strict=True))
    for name in plant.model.commands:
        used = (max(len(piece) // decimate, 1) * decimate for piece in recording.pieces)
        pairs = zip(recording.pieces, used, strict=True)
        command = np.concatenate([piece[name][:last:decimate] for piece, last in pairs])
        drivers[name] = command
        drivers[f"rate of {name}"] = np.gradient(command, result.time_s)
    found = [_dependence(name, values[:n], term[: len(values)]) for name, values in drivers.items()]
    return tuple(sorted(found, key=lambda each: -each.explains))


def _dependence(name: str, values: np.ndarray, term: np.ndarray) -> Dependence:
    """eta^2 = Var(E[d|s]) / Var(d) over quantile bins of s."""
    edges = np.unique(np.quantile(values, np.linspace(0, 1, BINS + 1)))
    if len(edges) < 3:
        return Dependence(name, 0.0, np.zeros((3, 0)))
    where = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    members = [where == k for k in range(len(edges) - 1)]
    members = [inside for inside in members if inside.any()]
    means = np.array([term[inside].mean() for inside in members])
    counts = np.array([inside.sum() for inside in members])
    between = float(np.sum(counts * (means - term.mean()) ** 2) / len(term))
    variance = float(term.var())
    bins = np.array(
        [
            [values[inside].mean() for inside in members],
            means,
            [term[inside].std() for inside in members],
        ]
    )
    return Dependence(name, between / variance if variance > 0 else 0.0, bins)

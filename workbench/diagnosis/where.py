"""Where a model fails: the missing term of each balance, from an unknown-input smoother.

A random walk is added to one state rate at a time, at *prior* parameters: a deterministic fit would
spread a valve or leak error into mass and damping and move the blame (diagnosis.md 4.3).  The gain
of log-likelihood over the filter without it, at the best of a few intensities, names the balance;
the smoothed walk, in N or kg/s, against the variables that drive it shows what is missing.

Source: diagnosis.md 1.3; Kristensen, Madsen and Jorgensen 2004 (significant diffusion terms).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.air import HEAT_CAPACITY_RATIO
from workbench.comparison.regimes import regime_shares
from workbench.diagnosis.result import Dependence, Where
from workbench.effect import Balance
from workbench.filtering import FilterResult, log_likelihoods, recording_filter, smooth
from workbench.fitting.problem import Problem
from workbench.linkage import Joint, Link
from workbench.parts import Body, Chamber
from workbench.plant import Candidate, Plant
from workbench.plant_filter import PlantFilter
from workbench.recording import Recording

GRID_S = 5e-3
BINS = 15
INTENSITIES = {  # of a rate, per sqrt(s)
    "velocity_m_s": (1.0, 5.0),
    "velocity_rad_s": (20.0, 100.0),
    "pressure_pa": (1e5, 1e6),
}
INTO_GAS = (Balance.VALVE, Balance.FLOW, Balance.MASS, Balance.ENERGY, Balance.SUPPLY)
PROCESS = {  # what no model is without
    "velocity_m_s": 0.3,
    "velocity_rad_s": 6.0,
    "pressure_pa": 3e4,
    "mass_kg": 1e-6,
}


@dataclass(frozen=True)
class Suspect:
    """A balance whose rate may lack a term."""

    balance: str
    state: str
    term_name: str
    factor: float


def locate(problem: Problem, recordings: Sequence[Recording]) -> Where | None:
    """Log-likelihood gain of each balance, and the missing term of the one that gains most.

    None for a plant without states, or where no filter run stayed finite.
    """
    plant = problem.whole.lean()
    suspects = _suspects(plant)
    if not suspects:
        return None
    recording = recordings[0]
    noise = dict(zip(plant.measured, problem.base.windows.noise, strict=True))
    decimate = max(round(GRID_S / recording.sample_time_s), 1)
    always = {s: PROCESS[k] for s in plant.state_list if (k := s.rpartition(".")[2]) in PROCESS}

    def lacking(unknown: dict[str, float]) -> PlantFilter:
        return recording_filter(plant, recording, unknown, noise, always, decimate)

    gains = _gains(suspects, lacking, recording)
    if not gains:
        return None
    worst = max(gains, key=lambda s: gains[s][0])
    result = smooth(lacking({worst.state: gains[worst][1]}), recording)
    term = result.unknown[0] * worst.factor
    return Where(
        balance=worst.balance,
        by_balance={s.balance: gain for s, (gain, _) in gains.items()},
        term_name=worst.term_name,
        time_s=result.time_s,
        term=term,
        term_deviation=result.unknown_deviation[0] * abs(worst.factor),
        against=_dependences(plant, recording, result, term, decimate),
        by_regime=regime_shares(problem.base),
    )


def acts_in(candidate: Candidate, balance: str) -> bool:
    """True where a cause enters a balance, as :attr:`Where.balance` names it.

    What acts on flows shows in the mass of every chamber, and what acts in one place only there.
    """
    place, _, kind = balance.rpartition(".")
    own = candidate.cause.balance
    if kind == Balance.MOMENTUM.value:
        return own is Balance.MOMENTUM
    return own in INTO_GAS and candidate.place in (None, place)


def _gains(
    suspects: list[Suspect],
    lacking: Callable[[dict[str, float]], PlantFilter],
    recording: Recording,
) -> dict[Suspect, tuple[float, float]]:
    """Log-likelihood that each suspect gains over a model without it, and at which intensity."""
    intensities = {s: INTENSITIES[s.state.rpartition(".")[2]] for s in suspects}
    trials = [(s, q) for s in suspects for q in intensities[s]]
    known = lacking({s.state: intensities[s][0] for s in suspects})
    factors = [[q / intensities[s][0] * (s is each) for s, q in trials] for each in suspects]
    plain, *likely = log_likelihoods(known, recording, np.pad(factors, ((0, 0), (1, 0))))
    gains: dict[Suspect, tuple[float, float]] = {}
    for (suspect, q), gain in zip(trials, likely - plain, strict=True):
        if np.isfinite(gain) and gain > gains.get(suspect, (-np.inf, q))[0]:
            gains[suspect] = float(gain), q
    return gains


def _suspects(plant: Plant) -> list[Suspect]:
    """One per body, link and chamber; pressures stand for the mass balance of their chamber.

    dp/dt = kappa R T / V mdot, so a missing mass flow is V / (kappa R T) times the missing rate.
    """
    found = []
    for part in plant.parts:
        if isinstance(part, Body):
            mass = float(part.mass_kg)
            state = f"{part.name}.velocity_m_s"
            found.append(Suspect(f"{part.name}.momentum", state, "force_n", mass))
        if isinstance(part, Link):
            state = f"{part.joint}.velocity_rad_s"
            inertia = float(part.inertia_kg_m2)
            found.append(Suspect(f"{part.joint}.momentum", state, "torque_n_m", inertia))
        if isinstance(part, Chamber) and any(isinstance(p, Body | Joint) for p in plant.parts):
            volume = float(part.dead_volume_m3) + float(part.area_m2 * part.stroke_m) / 2
            factor = volume / (
                HEAT_CAPACITY_RATIO * part.gas_constant_j_kg_k * part.initial_temperature_k
            )
            state = f"{part.name}.pressure_pa"
            found.append(Suspect(f"{part.name}.mass", state, "mass_flow_kg_s", factor))
    return found


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

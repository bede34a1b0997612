"""What a missing term depends on: without what the nominal parameters explain, and along loops.

A smoothed term holds the errors of the nominal parameters too.  Its regression on the columns
df/dp of its balance, each in the size of one prior deviation, with the priors as a ridge, takes
them out, and no more of them than the priors allow:

    t = argmin |d - C t|^2 / (Var(d) tau) + |t|^2,    rest = d - C t

tau is the correlation time of d in samples.  The correlation ratio eta^2 = Var(E[rest|s])/Var(rest)
then tells how far a variable s explains the rest.  A rest that differs between the two directions
of movement, or of a command, at the same s runs through a loop: memory, as of hysteresis, lag,
presliding or heat.

Source: diagnosis.md 1.3.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from workbench.diagnosis.missing_term import Course, Dependence, Loop
from workbench.fitting.unknowns import Unknowns
from workbench.identification.least_squares import correlation_samples
from workbench.plant import Plant

BINS = 15
FEWEST = 5  # samples of each direction in a bin that counts
SAME = 1e-6  # of the range of a signal: values that differ by less are one
REVERSAL = 0.1  # standard deviations that a signal comes back from its turning point


def parameter_columns(plant: Plant, unknowns: Unknowns, course: Course) -> np.ndarray:
    """What one prior deviation of each nominal parameter does to a balance, shape (n, n_p)."""
    known = [(k, n) for k, n in enumerate(unknowns.names) if n in plant.model.parameters]
    scale = unknowns.scale[[k for k, _ in known]]
    return scale * balance_columns(plant, [name for _, name in known], course)


def balance_columns(plant: Plant, names: Sequence[str], course: Course) -> np.ndarray:
    """What one unit of each parameter does to a balance along a course, shape (n, len(names)).

    In the unit of the missing flow of the balance; 0 where that changes nothing.
    """
    model, p = plant.model, plant.nominal[2]
    rows = [model.parameters.index(name) for name in (*names, course.flow)]
    rate = model.rates[model.states.index(course.state)]
    slope = ca.jacobian(rate, model.symbols[3][rows])
    slopes = ca.Function("slope", [*model.symbols], [ca.densify(slope)])
    n = course.states.shape[1]
    at = (course.states, course.commands, course.measured, np.tile(p[:, None], n))
    values = slopes.map(n)(*at).full().reshape(n, len(rows))
    answer = values[:, -1:]
    found = np.divide(values[:, :-1], answer, out=np.zeros((n, len(names))), where=answer != 0.0)
    return np.where(np.isfinite(found), found, 0.0)


def imitated(term: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """What of a term the nominal parameters explain within their priors, shape (n,).

    Their sizes follow from how the term varies; what is constant in it takes no part in that.
    """
    size = float(term.var()) * correlation_samples(term)
    if size <= 0.0:
        return np.zeros_like(term)
    varying = columns - columns.mean(axis=0)
    normal = varying.T @ varying / size + np.eye(columns.shape[1])
    return columns @ np.linalg.solve(normal, varying.T @ (term - term.mean()) / size)


def dependences(
    drivers: Mapping[str, np.ndarray],
    directions: Mapping[str, np.ndarray],
    term: np.ndarray,
    neighbour: np.ndarray,
) -> tuple[Dependence, ...]:
    """Dependence of a term on each variable, strongest first.

    ``directions`` hold 1 and -1 by the signal that moves, 0 where it rests; ``neighbour`` is the
    term at another intensity of its random walk.
    """
    found = [_dependence(name, s, directions, term, neighbour) for name, s in drivers.items()]
    return tuple(sorted(found, key=lambda each: -each.explains))


def _dependence(
    name: str,
    values: np.ndarray,
    directions: Mapping[str, np.ndarray],
    term: np.ndarray,
    neighbour: np.ndarray,
) -> Dependence:
    """eta^2 over quantile bins of a variable, and its loops."""
    begins = _begins(values)
    variance = float(term.var())
    if len(begins) < 2 or variance <= 0.0:
        return Dependence(name, 0.0, np.zeros((3, 0)))
    where = np.searchsorted(begins, values, side="right") - 1
    members = [where == k for k in range(len(begins))]
    members = [inside for inside in members if inside.any()]
    rows = (values, term, neighbour)
    centres, means, others = (_means(row, members) for row in rows)
    counts = np.array([inside.sum() for inside in members])
    between = float(np.sum(counts * (means - term.mean()) ** 2) / len(term))
    bins = np.array([centres, means, [term[inside].std() for inside in members]])
    explains = between / variance
    loops = (_loop(by, way, members, values, term) for by, way in directions.items())
    return Dependence(name, explains, bins, others, tuple(each for each in loops if each))


def _begins(values: np.ndarray) -> np.ndarray:
    """Where each bin begins.

    A signal at its limit, as a bristle that is bent, differs from sample to sample by rounding:
    that makes one bin, which begins below all of it.
    """
    found = np.quantile(values, np.arange(BINS) / BINS)
    alike = SAME * float(np.ptp(values))
    return found[np.diff(found, prepend=-np.inf) > alike] - alike


def _means(values: np.ndarray, members: list[np.ndarray]) -> np.ndarray:
    return np.array([values[inside].mean() for inside in members])


def _loop(
    by: str, way: np.ndarray, members: list[np.ndarray], values: np.ndarray, term: np.ndarray
) -> Loop | None:
    """The two branches over the bins that both pass through; None where there are none.

    What they tell apart of the variance is the sum over bins of n+ n- / (n+ + n-) times the square
    of their distance.
    """
    both = [(inside & (way > 0), inside & (way < 0)) for inside in members]
    both = [pair for pair in both if min(side.sum() for side in pair) >= FEWEST]
    if not both:
        return None
    up, down = ([pair[k] for pair in both] for k in (0, 1))
    branches = np.array([[_means(row, side) for row in (values, term)] for side in (up, down)])
    n_up, n_down = (np.array([inside.sum() for inside in side]) for side in (up, down))
    apart = n_up * n_down / (n_up + n_down) * (branches[0, 1] - branches[1, 1]) ** 2
    return Loop(by, float(apart.sum() / (len(term) * term.var())), branches)


def direction(values: np.ndarray) -> np.ndarray:
    """1 where a signal rises and -1 where it falls, between its turning points, (n,).

    Noise turns nothing: a turn is one that the signal then leaves by a tenth of its deviation.
    """
    back = REVERSAL * float(values.std())
    found, last, way = np.zeros(len(values)), values[0], 0.0
    for k, value in enumerate(values):
        if way * (value - last) >= 0.0 and way:
            last = value
        elif abs(value - last) > back:
            last, way = value, float(np.sign(value - last))
        found[k] = way
    return found


def side(values: np.ndarray) -> np.ndarray:
    """Sign of a velocity, 0 where it is less than a tenth of its deviation, (n,)."""
    return np.where(np.abs(values) > REVERSAL * values.std(), np.sign(values), 0.0)

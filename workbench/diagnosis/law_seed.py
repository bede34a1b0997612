"""A law read off the smoothed missing term, where the windows can name no single term.

A force that acts at one place only, a catch or a worn spot, is like no single term of a law, and a
term that is half of it gains little in windows that start free: it mends the error at the place and
makes one elsewhere.  The smoother shows such a force whole.  Its regression on the terms of the
balance, the next being the one that leaves least, gives up to three terms with their sizes;
regression blurs the sizes, so they are only where a fit by shooting begins.

Source: diagnosis.md 1.9; Pati, Rezaiifar and Krishnaprasad 1993 (orthogonal matching pursuit).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from workbench.candidate import Candidate
from workbench.diagnosis.dependence import balance_columns
from workbench.diagnosis.located import Where
from workbench.diagnosis.refit import Refit, refit_from, refit_shaken
from workbench.diagnosis.suspects import with_missing_flows
from workbench.fitting.problem import Problem
from workbench.plant import Plant
from workbench.rig_laws import laws_of

LEAST_EXPLAINED = 0.5  # of the variance of the missing term, by all terms together
LEAST_MORE = 0.03  # of it, by another term

Seed = tuple[tuple[Candidate, ...], Mapping[str, float]]  # terms, and their sizes by full name


def seeds(whole: Plant, where: Where | None, terms: Sequence[Candidate], most: int) -> list[Seed]:
    """Laws of one term, of two and so on up to ``most``, each beginning with the one before.

    None where the terms cannot explain half of what the smoother found missing beyond what the
    nominal parameters imitate.  ``whole`` is the plant with the terms in their places, absent.
    """
    if where is None or where.rest is None or where.course is None or not terms:
        return []
    plant, _ = with_missing_flows(whole.lean(keep=[law.name for law in laws_of(whole)]))
    rest = where.rest
    columns = balance_columns(plant, [term.strength for term in terms], where.course)
    found, chosen, left = [], [], float(rest @ rest)
    for _ in range(most):
        trials = {k: _regressed(rest, columns[:, [*chosen, k]]) for k in _new(columns, chosen)}
        if not trials:
            break
        best = min(trials, key=lambda k: trials[k][1])
        sizes, after = trials[best]
        if left - after < LEAST_MORE * float(rest @ rest):
            break
        chosen, left = [*chosen, best], after
        members = tuple(terms[k] for k in chosen)
        found.append((members, {m.strength: float(s) for m, s in zip(members, sizes, strict=True)}))
    return found if left < (1.0 - LEAST_EXPLAINED) * float(rest @ rest) else []


def _new(columns: np.ndarray, chosen: Iterable[int]) -> list[int]:
    """Terms that do anything in the balance and stand in the law not yet."""
    return [k for k in np.flatnonzero(columns.any(axis=0)).tolist() if k not in chosen]


def _regressed(values: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, float]:
    """Coefficients of least squares, and the sum of squares that they leave."""
    sizes = np.linalg.lstsq(columns, values, rcond=None)[0]
    left = values - columns @ sizes
    return sizes, float(left @ left)


def refitted(problem: Problem, seed: Seed) -> Refit:
    """All terms of a seed fitted by shooting, with all else from the base and from the priors."""
    terms, sizes = seed
    before = replace(problem, added=(*problem.added, *terms[:-1]))
    base = problem.base
    starts = (base.unknowns.values(share * base.point.t) for share in (1.0, 0.0))
    fits = [refit_from(before, terms[-1], {**start, **sizes}) for start in starts]
    return refit_shaken(before, min(fits, key=lambda each: each.fit.cost))

"""Which plan of two switching valves costs least, of as many as one sample has time for.

Plans, none of which switches sooner than a valve may, are commands ahead, shape (2, N).  Asked are

- the plans that were best a sample ago, by now shifted: another way to the target is not forgotten
  while it is a little dearer;
- no switch at all, and what the caller suggests;
- the best plan of a sample ago with one switch moved by a sample or two;
- of all pairs of blocked plans the best under the affine modes along it, ranked exactly;
- on the way to Neutral, at every second sample instead of these, plans from all over those of two
  switches per valve: far from a poor plan its modes tell nothing of a good one, and a brake that
  comes too early leaves the piston half-way.

Where few are judged, the last plan, no switch and the suggestion are always among them; what is cut
short are the other plans of a sample ago and the moved ones.

The nonlinear model judges each, so a plan is only changed for one that this prefers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from controllers.shift_prediction import ShiftPrediction
from controllers.switching_plans import Plans, every_plan, moved, plans
from linearize.valve_response import ValveResponse, age, packed
from linearize.valve_spread import AS_DESIGNED, Learned

KEPT = 8  # plans that a sample hands on to the next
RANKED = 4  # plans at least that come from the affine modes
GOLDEN = 0.5 * (5.0**0.5 - 1.0)  # its multiples fill an interval evenly, however many are taken


@dataclass(frozen=True)
class PlanSearch:
    """What is searched, and how much of it.

    A state x is that of :data:`linearize.shifting.STATES` in SI units, shape (4,); ``sent`` are the
    last commands of each valve as integers, the newest lowest; the query is that of
    :func:`controllers.shift_prediction.query`.

    responses, prediction    what the valves pass, and what the piston does under that
    horizon     N, samples
    judged      plans that the nonlinear model judges at a sample that ranks others, besides the
                last one; twice as many at one that does not
    price       of a switch, in samples of the whole way
    learned     of each valve
    """

    responses: tuple[ValveResponse, ValveResponse]
    prediction: ShiftPrediction
    horizon: int
    judged: int
    price: float
    learned: tuple[Learned, Learned] = (AS_DESIGNED, AS_DESIGNED)

    def best(
        self,
        x: np.ndarray,
        query: np.ndarray,
        sent: tuple[int, int],
        before: np.ndarray,
        suggested: np.ndarray,
        turn: int,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Plans, shape (k, 2, N), and their costs in samples, rising.

        ``before`` are those of the last sample, shifted, the best first, shape (k, 2, N), and
        ``suggested`` one more, shape (2, N).  ``turn`` counts the samples of a shift.
        """
        others = before[1:][self.keep(sent, before[1:])]
        known = [before[:1], self.held(sent)[None], suggested[None], others]
        near = np.concatenate([*known, moved(self.responses, sent, before[0])])
        near = near[: self.judged + 1 - RANKED]
        left = self.judged + 1 - len(near)
        if turn % 2 and not query[2]:
            far = self._spread(sent, turn, left + self.judged + 1)
        else:
            far = self._ranked(x, query, sent, before[0])[:left]
        asked = np.concatenate([near, far])
        costs = self.costs(x, query, sent, asked)
        order = _distinct(asked, np.argsort(costs, kind="stable"))
        return asked[order], costs[order]

    def costs(
        self, x: np.ndarray, query: np.ndarray, sent: tuple[int, int], asked: np.ndarray
    ) -> np.ndarray:
        """Costs of plans by the nonlinear model, in samples, shape (n,)."""
        shares = np.concatenate(self._shares(sent, asked.transpose(1, 0, 2)), axis=-1)
        by_model = self.prediction.judging.costs(x, shares, query)
        standing = np.broadcast_to(self.held(sent)[:, :1], (len(asked), 2, 1))
        switches = np.abs(np.diff(asked, axis=2, prepend=standing)).sum(axis=(1, 2))
        costs = by_model + self.price * switches
        costs[~np.isfinite(costs)] = np.inf
        return costs

    def held(self, sent: tuple[int, int]) -> np.ndarray:
        """No switch at all, shape (2, N)."""
        return np.repeat([[s & 1] for s in sent], self.horizon, axis=1)

    def keep(self, sent: tuple[int, int], asked: np.ndarray) -> np.ndarray:
        """True for each plan that switches no valve sooner than it may, shape (n,)."""
        pairs = zip(self.responses, sent, range(2), strict=True)
        both = [response.keeps(s, packed(asked[:, valve])) for response, s, valve in pairs]
        return both[0] & both[1]

    def plans(self, sent: int) -> Plans:
        """The blocked plans of one valve after these commands."""
        return plans(*self._free(sent))

    def _free(self, sent: int) -> tuple[int, int, int, int]:
        """Level of a valve, samples until it may switch, least time between switches, and N."""
        hold = self.responses[0].hold
        return sent & 1, max(hold - age(sent), 0), hold, self.horizon

    def _ranked(
        self, x: np.ndarray, query: np.ndarray, sent: tuple[int, int], before: np.ndarray
    ) -> np.ndarray:
        """The best pairs of plans under the modes along the last plan, shape (judged, 2, N)."""
        N, both = self.horizon, [self.plans(s) for s in sent]
        along = self._shares(sent, before)
        way, columns = self.prediction.along(x, np.concatenate(along, axis=1).ravel())
        by_share = columns.reshape(2, 2 * N, 2 * N)  # a row for each share: CasADi's columns
        valves = zip(self.responses, sent, both, self.learned, along, by_share, strict=True)
        moves = [
            (response.ahead(s, p.packed, learned) - was).reshape(-1, 2 * N) @ slopes
            for response, s, p, learned, was, slopes in valves
        ]
        costs = self.prediction.ranking.costs(way, moves, query)
        costs += self.price * np.add.outer(*(p.switches for p in both)).ravel()
        costs[~np.isfinite(costs)] = np.inf
        chosen = np.argpartition(costs, self.judged)[: self.judged]
        chosen = chosen[np.argsort(costs[chosen])]
        picked = np.divmod(chosen, len(both[0].switches))
        pairs = [p.commands[k] for p, k in zip(both, picked, strict=True)]
        return np.stack(pairs, axis=1)

    def _spread(self, sent: tuple[int, int], turn: int, number: int) -> np.ndarray:
        """So many of all pairs of plans, others at each turn, shape (number, 2, N)."""
        rows = [every_plan(*self._free(s)) for s in sent]
        places = (turn * number + np.arange(number)) * GOLDEN % 1.0
        picked = np.divmod((places * len(rows[0]) * len(rows[1])).astype(int), len(rows[1]))
        return np.stack([row[k] for row, k in zip(rows, picked, strict=True)], axis=1)

    def _shares(self, sent: tuple[int, int], commands: np.ndarray) -> list[np.ndarray]:
        """Shares of each valve, shape (..., N, 2), under commands of shape (2, ..., N)."""
        valves = zip(self.responses, sent, commands, self.learned, strict=True)
        return [response.ahead(s, packed(ahead), learned) for response, s, ahead, learned in valves]


def _distinct(asked: np.ndarray, order: np.ndarray) -> np.ndarray:
    """The first KEPT of the order, without what stands earlier in it too."""
    seen: dict[bytes, int] = {}
    for k in order:
        seen.setdefault(asked[k].tobytes(), k)
        if len(seen) == KEPT:
            break
    return np.array([*seen.values()])

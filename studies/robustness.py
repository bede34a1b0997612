"""What many closed loops over drawn parameters say: how often a line is missed, where, and why.

The probability of a miss is given with the exact interval of Clopper and Pearson (1934) at 95 %,
which is never too narrow, however few the draws.  What a parameter has to do with a figure is the
rank correlation of Spearman (1904) of the two: it asks for no straight line, and a loop that was
lost counts as the worst of all.  Over n draws of what has no influence its standard deviation is
1/sqrt(n - 1); three of these count as an influence.  A parameter that does harm in both directions
alike is not found in this way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from studies.text import columns, number
from workbench.units import public_name

CONFIDENCE = 0.95
CLEAR = 3.0  # standard deviations of a rank correlation without influence
FEWEST_RANKED = 20  # draws: below, a rank correlation says nothing
MOST_NAMED = 3  # influences of a line in a table
WORST_SHOWN = 3


@dataclass(frozen=True)
class Line:
    """One figure of all draws against what is asked of it.

    Attributes
    ----------
    name, asked
        In words.
    found
        The figure by draw, shape (n,), in the unit of ``unit``; infinite where there is none.
    missed
        By draw, shape (n,).
    """

    name: str
    asked: str
    found: np.ndarray
    missed: np.ndarray
    unit: str = ""

    @property
    def probability(self) -> float:
        """Share of the draws that miss the line."""
        return float(np.mean(self.missed))

    @property
    def interval(self) -> tuple[float, float]:
        """Of the probability, at 95 %."""
        from scipy.stats import binomtest

        counted = binomtest(int(np.sum(self.missed)), len(self.missed))
        found = counted.proportion_ci(CONFIDENCE, method="exact")
        return float(found.low), float(found.high)

    @property
    def worst(self) -> np.ndarray:
        """Draws, the farthest out first: of those that miss if any do, of all otherwise."""
        return np.lexsort((-self.found, ~self.missed))


@dataclass(frozen=True)
class Robustness:
    """Lines over the same draws, and how far each parameter was off in each draw.

    Attributes
    ----------
    deviations
        By parameter, shape (n,), in its standard deviations.
    each
        What one of them is called.
    """

    lines: tuple[Line, ...]
    deviations: Mapping[str, np.ndarray]
    each: str = "draw"

    @property
    def unranked(self) -> str:
        """Why influences are not known, where there are too few draws for any; empty otherwise."""
        enough = all(len(line.found) >= FEWEST_RANKED for line in self.lines)
        return "" if enough else f"{FEWEST_RANKED} {self.each}s or more needed"

    def influences(self, line: Line) -> tuple[tuple[str, float], ...]:
        """(parameter, rank correlation) of those that clearly matter, the strongest first."""
        from scipy.stats import rankdata

        n = len(line.found)
        ranks = rankdata(np.nan_to_num(line.found, nan=np.inf))
        if n < FEWEST_RANKED or np.ptp(ranks) == 0.0:
            return ()
        found = [
            (name, float(np.corrcoef(rankdata(off), ranks)[0, 1]))
            for name, off in self.deviations.items()
            if np.ptp(off) > 0.0
        ]
        clear = [each for each in found if abs(each[1]) > CLEAR / sqrt(n - 1)]
        return tuple(sorted(clear, key=lambda each: -abs(each[1])))

    @property
    def text(self) -> str:
        """A row per line, and the parameters of the worst draws."""
        head = ("line", "asked", "median", "95 %", "worst", "missed by", "probability", "moved by")
        rows = [self._row(line) for line in self.lines]
        told = [self.told(draw) for draw in self.worst[:WORST_SHOWN]]
        return "\n".join([columns(head, rows), *told])

    @property
    def worst(self) -> tuple[int, ...]:
        """The worst draw of each line, that of the line most often missed first."""
        lines = sorted(self.lines, key=lambda line: -line.probability)
        return tuple(dict.fromkeys(int(line.worst[0]) for line in lines))

    def _row(self, line: Line) -> Sequence[str]:
        low, high = line.interval
        median = float(np.median(line.found))
        most = float(np.quantile(line.found, CONFIDENCE, method="higher"))  # no draw is invented
        figures = [f"{number(v, 3)} {line.unit}".strip() for v in (median, most, line.found.max())]
        told = [f"{public_name(n)} {r:+.2f}" for n, r in self.influences(line)[:MOST_NAMED]]
        moved = ", ".join(told) or self.unranked or "-"
        missed = f"{int(line.missed.sum())} of {len(line.missed)}"
        chance = f"{line.probability:.1%} ({low:.1%} to {high:.1%})"
        return (line.name, line.asked, *figures, missed, chance, moved)

    def told(self, draw: int) -> str:
        """The parameters of one draw that were farthest off."""
        off = {name: float(each[draw]) for name, each in self.deviations.items()}
        if not any(off.values()):
            return f"{self.each} {draw + 1}: the rig's own values"
        farthest = sorted(off, key=lambda name: -abs(off[name]))[: MOST_NAMED + 2]
        words = (f"{public_name(name)} {off[name]:+.1f} sd" for name in farthest)
        return f"{self.each} {draw + 1}: " + ", ".join(words)

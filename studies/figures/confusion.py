"""What was hidden against what was named, as a map of counts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import PAGE_IN, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROW_IN = 0.17
SPACE_IN = 1.9  # for the names below, the title and the legend


def confusion_figure(title: str, answers: Sequence[tuple[str, str, bool]]) -> Figure:
    """Rows are hidden effects, columns what led the ranking, numbers how often.

    ``answers`` are (hidden, first in the ranking, right).  An answer that counts as wrong is
    crossed out: one beside the diagonal may be right where it is a printed tie.
    """
    hidden = list(dict.fromkeys(h for h, _, _ in answers))
    named = sorted({n for _, n, _ in answers}, key=lambda n: _place(n, hidden))
    counts = np.zeros((len(hidden), len(named)))
    wrong = np.zeros_like(counts)
    for h, n, right in answers:
        counts[hidden.index(h), named.index(n)] += 1
        wrong[hidden.index(h), named.index(n)] += not right
    with styled():
        figure = new_figure(PAGE_IN, SPACE_IN + ROW_IN * len(hidden))
        axes = figure.subplots()
        axes.imshow(counts, cmap="Blues", vmin=0.0, vmax=1.5 * counts.max(), aspect="auto")
        for i, k in zip(*np.nonzero(counts), strict=True):
            axes.text(k, i, f"{counts[i, k]:.0f}", ha="center", va="center")
            if wrong[i, k]:
                axes.plot(k, i, "x", color="k", markersize=11, markeredgewidth=0.6)
        axes.set_xticks(range(len(named)), named, rotation=60, ha="right")
        axes.set_yticks(range(len(hidden)), hidden)
        axes.grid(False)
        axes.set_xlabel("first in the ranking")
        axes.set_ylabel("hidden")
        axes.set_title(f"{title}: {len(answers)} answers, crossed where wrong")
    return figure


def _place(name: str, hidden: list[str]) -> tuple[int, str]:
    """Columns in the order of the rows, then what was never hidden."""
    plain = name.partition("@")[0]
    return (hidden.index(plain) if plain in hidden else len(hidden), name)

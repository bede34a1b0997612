"""The term that is missing in a balance, in N or l/min, over time and against what drives it."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from studies.figures.decimation import peaks
from studies.figures.style import BLUE, RED
from studies.page.look import MEASURED, chart, column, put, row, sharing, text
from studies.text import RATE, labelled, percent
from workbench.errors import listed
from workbench.units import display_scale, display_unit, public_name, suffix

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from bokeh.models import Model

    from workbench.diagnosis.located import Where
    from workbench.diagnosis.missing_term import Dependence

ANR_KG_M3 = 1.185  # air at 20 degC, 1 bar and 65 % humidity: ISO 8778, as flows are read in l/min
HEIGHT, SHOWN, MOST_POINTS = 190, 3, 2000
LITRES_PER_MIN = 6e4 / ANR_KG_M3


class MissingTerm:
    """Which balance lacks something, the term over time, and over its drivers."""

    def __init__(self) -> None:
        self._terms: Mapping[str, Where] = {}
        self._marked: tuple[str, ...] = ()

    def build(self) -> Model:
        """Its widgets."""
        from bokeh.models import Select

        self._head, self._told, self._charts = text(), text(), column()
        self._balance = Select(title="Look at the balance", options=[], width=260, name="balance")
        self._balance.on_change("value", lambda _a, _o, _n: self._draw())
        self._choice = row(self._balance)
        self._choice.visible = False
        return column(self._head, self._choice, self._told, self._charts)

    def show(self, terms: Mapping[str, Where]) -> None:
        """The missing terms of a diagnosis by balance, the worst first."""
        self._terms = {_words(name): where for name, where in terms.items()}
        self._choice.visible = bool(terms)
        self._balance.options = names = [*self._terms]
        first = names[0] if names else ""
        self._marked = next((where.marked for where in terms.values()), ())
        head = _head([_words(name) for name in self._marked]) if first else ""
        put(self._head, head)
        if self._balance.value == first:
            self._draw()
        else:
            self._balance.value = first

    def _draw(self) -> None:
        """The term of the chosen balance."""
        put(self._told, "")
        self._charts.children = []
        where = self._terms.get(self._balance.value)
        if where is None:
            return
        factor, unit = in_people(where.term_name)
        flow = public_name(where.term_name).replace("_", " ")
        told = f"What an unknown {flow} would have to be ({unit}), one deviation shaded."
        put(self._told, f'<p class="guide">{told}</p>')
        strongest = [each for each in where.against if each.bins.shape[1]][:SHOWN]
        below = [_dependence(each, factor, unit) for each in strongest]
        for each in below:
            sharing(each, 1, 260)
        gained, term = _balances(where, self._marked), _over_time(where, factor, unit)
        first = row(sharing(gained, 1, 320), sharing(term, 2, 520))
        self._charts.children = [first, row(*below, top=True)]


def _words(balance: str) -> str:
    return public_name(balance).replace("_", " ").replace(".", " ")


def in_people(name: str) -> tuple[float, str]:
    """Factor from SI and unit of a missing term: N for forces, l/min (ANR) for mass flows."""
    if suffix(name) == "kg_s":
        return LITRES_PER_MIN, "l/min ANR"
    return 1.0 / display_scale(name).factor, display_unit(name)


def _head(marked: Sequence[str]) -> str:
    """Which balance fails, one of several alike, or none more than chance gives."""
    if not marked:
        return "<h2>Where the plant fails: no balance stands out</h2>"
    one = "the balance" if len(marked) == 1 else "one of the balances"
    return f"<h2>Where the plant fails: {one} {escape(listed(marked))}</h2>"


def _balances(where: Where, marked: Collection[str]) -> Any:
    """Log-likelihood that an unknown flow gains, by balance."""
    from bokeh.models import FactorRange

    gains = sorted(where.by_balance.items(), key=lambda item: item[1])[-8:]
    names = [_words(name) for name, _ in gains]
    title = "one of them lacks something" if len(marked) > 1 else "which balance lacks something"
    found = chart(
        "gained log-likelihood (-)", "", HEIGHT, title if marked else "none stands out",
        y_range=FactorRange(*names), tools="",
    )  # fmt: skip
    colours = [RED if name in marked else MEASURED for name, _ in gains]
    found.hbar(names, height=0.6, right=[max(g, 0.0) for _, g in gains], color=colours)
    return found


def _over_time(where: Where, factor: float, unit: str) -> Any:
    rows = np.array([where.term, where.term - where.term_deviation])
    kept = peaks(rows, 0, rows.shape[1], MOST_POINTS)
    time, term = where.time_s[kept], factor * where.term[kept]
    spread = factor * where.term_deviation[kept]
    found = chart("time (s)", f"missing ({unit})", HEIGHT, "the missing term over time")
    found.varea(time, term - spread, term + spread, color=BLUE, alpha=0.25)
    found.line(time, term, color=BLUE, line_width=1.2)
    return found


def _dependence(each: Dependence, factor: float, unit: str) -> Any:
    """Means of the term in bins of one driver, without what parameters explain."""
    per = 1.0 / display_scale(each.variable.removeprefix(RATE)).factor
    centres, means, spreads = each.bins * np.array([[per], [factor], [factor]])
    title = f"follows {_words(each.variable)}: {percent(each.explains)}"
    found = chart(labelled(each.variable), f"missing ({unit})", HEIGHT, title, tools="")
    found.varea(centres, means - spreads, means + spreads, color=BLUE, alpha=0.25)
    found.line(centres, means, color=BLUE, line_width=1.5)
    found.scatter(centres, means, color=BLUE, size=5)
    return found

"""Figures of a diagnosis: the ranking, the balances, and the term that is missing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import (
    BLUE,
    COLUMN_IN,
    GREY,
    ORANGE,
    PAGE_IN,
    RED,
    new_figure,
    styled,
    thinned,
)
from studies.text import RATE, labelled
from workbench.diagnosis.result import DecidedBy, told
from workbench.units import display_scale, display_unit, public_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    from workbench.diagnosis.located import Where
    from workbench.diagnosis.missing_term import Dependence, Loop
    from workbench.diagnosis.result import Diagnosis, Ranked

SHOWN, SHOWN_BALANCES, SHOWN_DRIVERS = 10, 8, 3
FEWEST_ROWS = 3  # that a panel has room for: one balance alone would be a wall
HOLLOW = {"color": "white", "edgecolor": GREY, "hatch": "....", "linewidth": 0.6}
CUT = -20.0  # percent: bars further below zero would leave the others no room
MINUS = "\N{MINUS SIGN}"  # as on the axis
LETTER = 5.0  # percent of the axis for one of a number beside a bar
SAID = 0.02  # of the variance of a missing term: less that parameters explain is not said


def diagnosis_figures(found: Diagnosis, prefix: str = "") -> dict[str, Figure]:
    """All figures of a diagnosis, by file name."""
    figures = {f"{prefix}ranking": ranking_figure(found)} if found.ranking else {}
    if found.where:
        figures[f"{prefix}missing_term"] = missing_term_figure(found.where)
    return figures


def ranking_figure(found: Diagnosis) -> Figure:
    """How much of the misfit each effect takes away, on both sets; ties are marked.

    Rows stand in the order of the ranking: refits first, then what the scan alone decided, whose
    bars are estimates and may be longer than those of refits above them.
    """
    rows = found.ranking[:SHOWN]
    leader = rows[0]
    tied = {leader.candidate.name, *leader.alike} if leader.alike else set()
    with styled():
        figure = new_figure(COLUMN_IN, 1.2 + 0.27 * len(rows))
        axes = figure.subplots()
        axes.set_yticks(range(len(rows)), [_ranked_name(row.candidate.name, tied) for row in rows])
        for label, row in zip(axes.get_yticklabels(), rows, strict=True):
            named = row is leader or row.candidate.name in leader.alike
            label.set_fontweight("bold" if row.accepted and named else "normal")
        _draw_drops(axes, rows)
        axes.set_ylim(len(rows) - 0.5, -0.5)
        cut = _scale_drops(axes, len(rows))
        key = "bold: accepted" + ("; =: cannot be told apart here" if tied else "")
        key += f"\nbars cut at {MINUS}{-CUT:.0f} %, with their length" if cut else ""
        figure.suptitle(f"{found.verdict.value.replace('_', ' ')}\n{key}", fontsize=8)
        if axes.containers:
            figure.legend(loc="outside lower center", ncols=3, columnspacing=1.0)
    return figure


def _draw_drops(axes: Axes, rows: Sequence[Ranked]) -> None:
    """Two bars for a refit, one hollow bar for what the scan alone decided."""
    refitted = [k for k, row in enumerate(rows) if row.decided_by is DecidedBy.REFIT]
    scanned = [k for k, row in enumerate(rows) if row.decided_by is DecidedBy.SCAN]
    held_out = [k for k in refitted if np.isfinite(rows[k].drop_validation)]
    train = {k: _bar(rows[k].drop_train) for k in (*refitted, *scanned)}
    checked = {k: _bar(rows[k].drop_validation) for k in held_out}
    bars = (
        (refitted, train, -0.2, {"color": BLUE, "label": "training"}),
        (held_out, checked, 0.2, {"color": ORANGE, "hatch": "////", "label": "validation"}),
        (scanned, train, 0.0, HOLLOW | {"label": "training, only scanned"}),
    )
    for places, drops, shift, look in bars:
        if places:
            axes.barh([k + shift for k in places], [drops[k] for k in places], 0.38, **look)


def _bar(share: float) -> float:
    """Length of a bar in percent, as it is told: below zero for what makes the misfit larger."""
    return 100.0 * told(share)


def _scale_drops(axes: Axes, count: int) -> bool:
    """The axis of the bars; what goes far below zero is cut there, its number beside it.

    The bars keep their lengths, and with them the table of what is drawn.  True where any is cut.
    """
    bars = [bar for group in axes.containers for bar in group]
    axes.set_xlim(0.0, 105.0)
    axes.set_xlabel("drop of the misfit beyond noise (%)")
    if not any(bar.get_width() < 0.0 for bar in bars):
        return False
    axes.vlines(0.0, -0.5, count - 0.5, color=GREY, linewidth=0.6)
    axes.set_xticks(range(int(CUT), 101, 20))
    axes.set_xlim(CUT, 105.0)
    told_beside = [_cut(axes, bar, count) for bar in bars if bar.get_width() < CUT]
    if told_beside:
        axes.set_xlim(CUT - LETTER * max(map(len, told_beside)), 105.0)
    return bool(told_beside)


def _cut(axes: Axes, bar: Rectangle, count: int) -> str:
    """Cut a bar, and write its length at its end."""
    from matplotlib.patches import Rectangle

    shown = Rectangle((CUT, -0.5), 105.0 - CUT, count, transform=axes.transData)
    bar.set_clip_path(shown)
    length = bar.get_width()
    words = MINUS + (f"{-length:.0f}" if length > -1e3 else f"{-length:.0e}")
    middle = bar.get_y() + 0.5 * bar.get_height()
    axes.annotate(
        words, (CUT, middle), (-1.5, 0.0), textcoords="offset points",
        ha="right", va="center", fontsize=6,
    )  # fmt: skip
    return words


def _ranked_name(name: str, tied: set[str]) -> str:
    return f"= {name}" if name in tied else name


def missing_term_figure(where: Where) -> Figure:
    """Gain by balance, the missing term in time, and against what drives it most.

    One panel is always the usual one: a force against velocity, a flow against a command.
    """
    strongest = _panels(where)
    with styled():
        figure = new_figure(PAGE_IN, 4.0 if strongest else 1.8)
        rows = figure.add_gridspec(2 if strongest else 1, 1)
        above = rows[0].subgridspec(1, 2, width_ratios=(2.4, 1))
        _draw_term(figure.add_subplot(above[0]), where)
        _draw_balances(figure.add_subplot(above[1]), where)
        below = rows[1].subgridspec(1, len(strongest)) if strongest else ()
        for k, dependence in enumerate(strongest):
            axes = figure.add_subplot(below[k])
            _draw_dependence(axes, where, dependence)
            if k == 0 and not dependence.memory:
                _leave_room(axes, 0.25)
                axes.legend(loc="upper left")
    return figure


def _panels(where: Where) -> list[Dependence]:
    """What the term follows most, and the variable that engineers look for first."""
    drawable = [each for each in where.against if each.bins.shape[1]]
    strongest = drawable[:SHOWN_DRIVERS]
    names, looked_for = [each.variable for each in drawable], _looked_for(where)
    usual = next((name for name in names if name in looked_for), None)
    if usual is None or usual in names[:SHOWN_DRIVERS]:
        return strongest
    return [*strongest[:-1], drawable[names.index(usual)]]


def _looked_for(where: Where) -> set[str]:
    """Velocities of what a force moves; of a flow the commands, which alone have rates."""
    place, _, kind = where.balance.rpartition(".")
    if kind == "momentum":
        return {f"{place}.velocity_m_s", f"{place}.velocity_rad_s"}
    names = (each.variable for each in where.against)
    return {name.removeprefix(RATE) for name in names if name.startswith(RATE)}


def _term(where: Where) -> tuple[float, str]:
    """Factor from SI to what people read, and the axis label of the missing term."""
    factor = 1.0 / display_scale(where.term_name).factor
    words = public_name(where.term_name).replace("_", " ")
    return factor, f"missing {words} ({display_unit(where.term_name)})"


def _draw_term(axes: Axes, where: Where) -> None:
    factor, label = _term(where)
    time_s, term, spread = thinned(where.time_s, factor * where.term, factor * where.term_deviation)
    axes.fill_between(time_s, term - spread, term + spread, color=BLUE, alpha=0.2, linewidth=0)
    if where.intensities:
        other = thinned(where.time_s, factor * where.intensities.term)
        softer = where.intensities.neighbour < where.intensities.likeliest
        label_other = f"walk {'slower' if softer else 'faster'} than the likeliest"
        axes.plot(*other, color=ORANGE, linewidth=0.6, linestyle="--", label=label_other)
    axes.plot(time_s, term, color=BLUE, linewidth=0.6, label="missing term, one deviation shaded")
    axes.set_xlabel("time (s)")
    axes.set_ylabel(label)
    title = f"what the balance {public_name(where.balance)} lacks"
    if where.alike:
        title += ", if it is that one"
    if not where.certain:
        title = f"unknown input of {public_name(where.balance)}, hardly more than chance"
    if where.imitated > SAID:
        title += f" (below: without {100.0 * where.imitated:.0f} % that parameters may explain)"
    axes.set_title(title)
    _leave_room(axes, 0.25)
    axes.legend(loc="upper right", ncols=2)


def _draw_balances(axes: Axes, where: Where) -> None:
    gains = sorted(where.by_balance.items(), key=lambda item: -item[1])[:SHOWN_BALANCES]
    places = np.arange(len(gains))
    axes.set_yticks(places, [name.replace(".", " ").replace("_", " ") for name, _ in gains])
    marked = where.marked
    colours = [RED if name in marked else GREY for name, _ in gains]
    axes.barh(places, [max(gain, 0.0) for _, gain in gains], 0.6, color=colours)
    axes.set_ylim(max(len(gains), FEWEST_ROWS) - 0.5, -0.5)
    axes.set_xlabel("gained log-likelihood (-)")
    told = "one of them" if len(marked) > 1 else "which balance"
    axes.set_title(told if marked else "no balance stands out")


def _draw_dependence(axes: Axes, where: Where, dependence: Dependence) -> None:
    factor, label = _term(where)
    name = dependence.variable
    per = 1.0 / display_scale(name.removeprefix(RATE)).factor
    centres, means, spreads = dependence.bins * np.array([[per], [factor], [factor]])
    band = {"color": BLUE, "alpha": 0.2, "linewidth": 0, "label": "one deviation in each bin"}
    axes.fill_between(centres, means - spreads, means + spreads, **band)
    loop = dependence.memory
    if loop:
        axes.plot(centres, means, color=BLUE, linewidth=0.6)
        _draw_loop(axes, loop, per, factor)
    else:
        axes.plot(centres, means, "o-", color=BLUE, markersize=2.5)
        if dependence.neighbour is not None:
            axes.plot(centres, factor * dependence.neighbour, "--", color=ORANGE)
    axes.axhline(0.0, color=GREY, linewidth=0.6)
    axes.set_xlabel(labelled(name))
    axes.set_ylabel(label)
    axes.locator_params(axis="x", nbins=4)
    also = f", a loop {100.0 * loop.adds:.0f} % more" if loop else ""
    axes.set_title(f"explains {100.0 * dependence.explains:.0f} %{also}")


def _draw_loop(axes: Axes, loop: Loop, per: float, factor: float) -> None:
    """The two ways of a loop: memory."""
    by = public_name(loop.by).replace("_", " ").replace(".", " ")
    ways = ("positive", "negative") if "velocity" in loop.by else ("rising", "falling")
    styles = ("^-", BLUE), ("v--", RED)
    for way, (marks, colour), (centres, means) in zip(ways, styles, loop.branches, strict=True):
        label = f"{by} {way}"
        axes.plot(per * centres, factor * means, marks, color=colour, markersize=2.5, label=label)
    _leave_room(axes, 0.5)
    axes.legend(loc="upper left")


def _leave_room(axes: Axes, share: float) -> None:
    """Room above for a legend, as a share of what is shown."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + share * (high - low))

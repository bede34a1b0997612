"""Tab 5: the plant as modes, where each is active and predicts, and cuts that can be moved."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.page.control_verbs import modes_action, with_linearised
from studies.page.drawn import as_html
from studies.page.look import button, column, guide, put, row, text, wide
from studies.page.session import Role, Session, recordings
from studies.page.verbs import counted, require_rig
from studies.text import number
from workbench.units import display_scale, display_unit, public_name

if TYPE_CHECKING:
    from bokeh.models import Model

    from linearize.cuts import Interval
    from studies.page.control_tasks import Linearised, ModeChoice
    from studies.page.view import Page

STANDARD, REGIMES, PLACED = "standard", "by flow regimes", "placed where recordings go"


class ModesTab:
    """Which modes, their drawings and table, and the boundaries between them."""

    title = "Modes"

    def __init__(self, page: Page) -> None:
        self._page = page
        self._sliders: list[tuple[Any, Any]] = []

    def build(self) -> Model:
        """Its widgets."""
        from bokeh.models import Select, Spinner

        self._kind = Select(title="Modes", options=[STANDARD, REGIMES, PLACED], value=STANDARD,
                            width=260, name="mode_kind")  # fmt: skip
        self._number = Spinner(title="How many (placed)", low=1, value=12, width=140)
        self._error, self._table = text(name="mode_error"), text()
        self._cuts = column()
        self._drawn = [text() for _ in range(3)]
        return column(
            guide("See the plant as linear modes, where each is active and how far it predicts; "
                  "move a boundary between modes and see the prediction error change."),
            row(self._kind, self._number,
                button("Linearise", self._linearise, main=True, name="linearise")),
            self._error,
            self._cuts,
            *self._drawn,
            self._table,
        )  # fmt: skip

    def of(self, session: Session) -> tuple[Any, ...]:
        """Parts of a session that it shows."""
        return session.linearised, session.linearised_before

    def show(self, session: Session) -> None:
        """The modes of a session."""
        found = session.linearised
        self._cuts.children = []
        if found is None:
            for each in (self._error, self._table, *self._drawn):
                put(each, "")
            return
        before = session.linearised_before
        change = ""
        if before is not None and before.error == before.error:
            change = f" (before {number(100.0 * before.error, 3)} %)"
        said = f"{found.count} modes"
        if found.error == found.error:
            said += "; prediction error over 50 ms along the training recordings "
            said += f"{number(100.0 * found.error, 3)} % of a state's scale{change}"
        put(self._error, f'<p role="status"><b>{said}</b></p>')
        for place, name in zip(self._drawn, ("map", "step", "poles"), strict=True):
            put(place, as_html(found.drawn[name]) if name in found.drawn else "")
        put(self._table, wide(found.text))
        self._cuts.children = [*self._movable(found)]

    def _movable(self, found: Linearised) -> list[Any]:
        """A slider for each boundary."""
        from bokeh.models import Slider

        from studies.page.mode_cuts import boundaries

        self._sliders = []
        if not boundaries(dict(found.cuts)):
            return [text('<p class="guide">These modes are no product of intervals: their '
                         "boundaries come from the physics.</p>")]  # fmt: skip
        if not found.choice.cuts_file:
            return [row(button("Cut by hand", self._by_hand, name="cut_by_hand"))]
        for each in boundaries(dict(found.cuts)):
            scale = display_scale(each.signal)
            low, value, high = map(scale.from_si, (each.lower, each.value, each.upper))
            room = 0.02 * (high - low)
            unit = f" ({display_unit(each.signal)})" if display_unit(each.signal) else ""
            slider = Slider(
                title=f"{public_name(each.signal)}, boundary {each.number + 1}{unit}",
                start=low + room, end=high - room, value=value, step=(high - low) / 200.0,
                width=300, format="0[.]0000",
            )  # fmt: skip
            slider.on_change("value_throttled", lambda _a, _o, _n: self._move())
            self._sliders.append((each, slider))
        return [row(*(slider for _, slider in self._sliders))]

    def _linearise(self) -> None:
        kind = self._kind.value
        from studies.page.control_tasks import ModeChoice

        placed, number = None, self._number.value
        if kind == PLACED:
            if not self._page.allows(lambda _: counted(number, "modes")):
                return
            placed = counted(number, "modes")
        self._start(ModeChoice(kind == REGIMES, placed))

    def _by_hand(self) -> None:
        """The same cuts with operating points of their own, as a file of cuts has them."""
        self._cut(dict(self._page.session.linearised.cuts))

    def _move(self) -> None:
        """The modes with the boundaries where the sliders are; those under way are not wanted."""
        from studies.page.control_tasks import linearise
        from studies.page.mode_cuts import moved

        page = self._page
        changes = [
            (each, display_scale(each.signal).to_si(slider.value)) for each, slider in self._sliders
        ]
        page.supersede(linearise)
        if page.allows(require_rig):
            self._cut(moved(dict(page.session.linearised.cuts), changes))
        else:
            self._back()

    def _back(self) -> None:
        """The sliders where the boundaries are."""
        if self._page.session.linearised:
            self._cuts.children = [*self._movable(self._page.session.linearised)]

    def _cut(self, cuts: dict[str, tuple[Interval, ...]]) -> None:
        from studies.page.control_tasks import ModeChoice
        from studies.page.mode_cuts import cuts_text

        session = self._page.session
        first = Path(session.steps[0].rig_file)
        target = str(first.with_name(f"{first.stem}_cuts.toml"))
        choice = ModeChoice(cuts_file=target, cuts=cuts_text(cuts))
        self._start(choice)

    def _start(self, choice: ModeChoice) -> None:
        from studies.page.control_tasks import linearise

        page = self._page
        if not page.allows(require_rig):
            return
        session = page.session
        action = modes_action(session, choice)
        page.work(
            action,
            lambda found: lambda now: with_linearised(now, found, action),
            linearise, session.now.rig,
            recordings(session.of(Role.TRAINING)), choice,
            otherwise=self._back,
        )  # fmt: skip

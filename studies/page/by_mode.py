"""A controller and an estimator for each mode: a line of choices, and what the choice bears."""

from __future__ import annotations

from html import escape
from math import degrees, isinf
from typing import TYPE_CHECKING, Any

from studies.page.control_verbs import with_offers
from studies.page.look import column, put, row, text
from studies.page.replay import NO_ACTION
from studies.page.verbs import require_rig
from studies.text import number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bokeh.models import Model

    from controllers.margins import Margins
    from studies.page.offers import Offers
    from studies.page.view import Page

AS_ABOVE = "as above"


class ByMode:
    """Shown where the controller is the one by mode."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._observers: Sequence[str] = ()
        self._open = False
        self._methods: dict[str, Any] = {}
        self._estimators: dict[str, Any] = {}

    def build(self) -> Model:
        """Its widgets; empty until they are asked for."""
        self._lines = column()
        said = "For each mode in which the valve drives the motion, the method and the estimator; "
        said += "beside it, what the loop of that mode bears."
        self._whole = column(text(f"<p>{said}</p>"), self._lines)
        self._whole.visible = False
        return self._whole

    def open(self, method: str, observers: Sequence[str]) -> bool:
        """Ask what each method bears where the controller is the one by mode.

        False where that cannot be asked now.
        """
        from studies.page.offers import PER_MODE, mode_offers

        page, self._observers = self._page, tuple(observers)
        asks = method == PER_MODE and page.session.offers is None
        if asks and not page.allows(require_rig):
            return False
        self._open = self._whole.visible = method == PER_MODE
        if asks:
            page.work(
                NO_ACTION,
                lambda found: lambda session: with_offers(session, found),
                mode_offers, page.session.now.rig,
            )  # fmt: skip
        return True

    def show(self, offers: Offers | None) -> None:
        """A line for each mode; the choices made so far stay."""
        from studies.page.offers import AT_REST

        if offers is None:
            self._lines.children, self._methods, self._estimators = [], {}, {}
            return
        if {*self._methods} == {*offers.modes}:
            return
        self._methods, self._estimators, lines = {}, {}, []
        for mode, margins in offers.margins.items():
            lines.append(self._line(mode, margins))
        rest = self._estimator(AT_REST, "At rest, estimator")
        self._lines.children = [*lines, row(rest)]

    def _line(self, mode: str, margins: Mapping[Any, Margins]) -> Model:
        from bokeh.models import Select

        known = {method.value: found for method, found in margins.items()}
        method = Select(title=mode, options=[*known], value=next(iter(known)), width=200)
        told = text(bears(known[method.value]), sizing_mode="fixed", width=420)
        method.on_change("value", lambda _a, _o, new: put(told, bears(known[new])))
        self._methods[mode] = method
        return row(method, self._estimator(mode, f"Estimator, {mode}"), told)

    def _estimator(self, mode: str, title: str) -> Model:
        from bokeh.models import Select

        found = Select(title=title, options=[AS_ABOVE, *self._observers], value=AS_ABOVE, width=240)
        self._estimators[mode] = found
        return found

    def with_choices(self, spec: str, observers: list[str]) -> tuple[str, list[str]]:
        """The specification and the estimators with what is chosen by mode, where that is open."""
        from studies.page.offers import with_methods, with_observers

        if not self._open or not self._methods:
            return spec, observers
        methods = {mode: select.value for mode, select in self._methods.items()}
        chosen = {m: s.value for m, s in self._estimators.items() if s.value != AS_ABOVE}
        return with_methods(spec, methods), [with_observers(each, chosen) for each in observers]


def bears(found: Margins) -> str:
    """Margins of one mode as a line with a verdict."""
    if not found.stable:
        return '<p class="wrong" role="status">unstable in this mode</p>'
    low, high = found.gain
    gain = "any gain above" if isinf(high) else f"gain up to {number(high, 3)} times"
    down = f", down to {number(low, 3)}" if low else ""
    told = f"{gain}{down}, {number(degrees(found.phase_rad), 3)}° of phase, "
    told += f"{number(1e3 * found.delay_s, 3)} ms more delay"
    return f'<p class="calm" role="status">stable: {escape(told)}</p>'

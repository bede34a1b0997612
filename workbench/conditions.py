"""The plant at one instant, and what is said to whoever asks it for what it does not have."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING

from workbench.errors import Message, listed, nearest

if TYPE_CHECKING:
    from workbench.effect import Expression


class UnknownQuantityError(AttributeError, KeyError):
    """A part or a quantity that the plant does not have; ``message`` is what to tell of it."""

    __str__ = Exception.__str__  # that of KeyError shows the quotes of a string

    def __init__(self, message: Message) -> None:
        super().__init__(str(message))
        self.message = message

    def __reduce__(self) -> tuple[type[UnknownQuantityError], tuple[Message]]:
        return type(self), (self.message,)


class Quantities(SimpleNamespace):
    """The quantities of one part, ``now["slide"].velocity_m_s``."""

    __slots__ = ("_part",)

    def __init__(self, part: str) -> None:
        super().__init__()
        self._part = part

    def __getattr__(self, quantity: str) -> Expression:
        raise _unknown(f"{self._part} has no {quantity}", quantity, vars(self))

    def __reduce__(self) -> tuple[type[Quantities], tuple[str], dict[str, Expression]]:
        return type(self), (self._part,), vars(self)


class Conditions(dict[str, Quantities]):
    """The plant at one instant, in SI units: ``now["chamber_a"].pressure_pa``.

    Raises
    ------
    UnknownQuantityError
        As a KeyError for a part that is not there, as an AttributeError for a quantity, with those
        that are there and the nearest of them.
    """

    def __missing__(self, part: str) -> Quantities:
        raise _unknown(f"the plant has no {part!r}", part, self)

    def place(self, name: str, value: Expression) -> None:
        """Set a quantity by its full name, for example ``chamber_a.pressure_pa``."""
        part, _, quantity = name.rpartition(".")
        if part not in self:
            self[part] = Quantities(part)
        setattr(self[part], quantity, value)

    def read(self, name: str, by: str = "") -> Expression:
        """Get a quantity by its full name; ``by`` is who asks, where that is worth telling."""
        part, _, quantity = name.rpartition(".")
        try:
            if not part:
                raise _unknown(f"the plant has no {name!r}", name, dict(self.named()))
            return getattr(self[part], quantity)
        except UnknownQuantityError as error:
            what = f"{by}: {error.message.what}" if by else error.message.what
            raise UnknownQuantityError(replace(error.message, what=what)) from None

    def copied(self) -> Conditions:
        """The same quantities, apart from those that are placed here later."""
        copy = Conditions()
        for name, value in self.named():
            copy.place(name, value)
        return copy

    def named(self) -> Iterable[tuple[str, Expression]]:
        """Every quantity with its full name."""
        for part, own in self.items():
            yield from ((f"{part}.{quantity}", value) for quantity, value in vars(own).items())


def no_rate(state: str, rates: Iterable[str]) -> UnknownQuantityError:
    """What is wrong with a member that brings a state and does not say how it changes."""
    member, _, quantity = state.rpartition(".")
    given = [name.rpartition(".")[2] for name in rates if name.rpartition(".")[0] == member]
    what = f"{member} has a state {quantity}, and its rates() give no such rate"
    return _unknown(what, quantity, given, f"; they give {listed(given) or 'none'}")


def _unknown(
    what: str, name: str, known: Iterable[str], there: str | None = None
) -> UnknownQuantityError:
    known = list(known)
    there = f"; it has {listed(known) or 'nothing'}" if there is None else there
    return UnknownQuantityError(Message(what + there, nearest=nearest(name, known)))

"""What owns a balance: a part, and the equations that it keeps."""

from __future__ import annotations

from dataclasses import dataclass

from workbench.effect import Balance, Conditions, Effect, Expression, Received, Term


@dataclass(frozen=True, kw_only=True)
class BalanceEquation:
    """One balance that a part keeps, for the search of where a model fails.

    balance     what is balanced
    kind        the flows that it takes; a part's own subclass of :class:`Term` will do
    term        a missing flow by name with its unit, ``force_n``
    state       own state whose rate the flows drive
    rates       smaller and larger size of what may be missing in that rate per square root of a
                second, in the state's unit: a walk so fast is told from noise, and not from a kink
    """

    balance: Balance
    kind: type[Term]
    term: str
    state: str
    rates: tuple[float, float]


class Part(Effect):
    """A part owns a balance: it collects the flows that others put in."""

    @property
    def balances(self) -> tuple[BalanceEquation, ...]:
        """What it balances; see :class:`BalanceEquation`."""
        return ()

    def derive(self, now: Conditions) -> dict[str, Expression]:
        """Quantities that follow from the states at once, for example a volume."""
        return {}

    def close(self, now: Conditions, received: Received) -> dict[str, Expression]:
        """Quantities that follow from what was received, for example a held rod's force."""
        return {}

"""What a part says of its balances: which flows they take, and in which state a missing one shows.

Source: diagnosis.md 1.3 (a missing term per balance equation).
"""

from __future__ import annotations

from dataclasses import dataclass

from workbench.effect import Balance, Conditions, Expression, MassFlow, Term


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

    def missing(self, part: str, size: Expression, now: Conditions) -> Term:
        """A flow of which only the size is known; gas comes at the temperature of the part."""
        if issubclass(self.kind, MassFlow):
            return self.kind(part, size, now[part].temperature_k)
        return self.kind(part, size)

"""Whether what a user's own plant says arrives: its names, its flows and its signals.

The plants of the list are tested as they are.  A plant from a file is looked at here once it is
loaded, so that what would have no effect shows before the first run.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from workbench.cause_checks import cause_faults, own
from workbench.conditions import Conditions, UnknownQuantityError
from workbench.effect import AddedMass, Effect, Force, HeatFlow, MassFlow, Term, Torque
from workbench.effects.timing import Timing
from workbench.errors import InputError, Message, listed, nearest
from workbench.model import Model
from workbench.plant import Plant
from workbench.plant_numbers import altered, derived, not_absent, not_numbers

# By kind of flow what of a member it moves.  Where nothing does, as with the pressure of a supply,
# the flow goes to where there is enough, and nobody counts it.
MOVED = {
    Force: "position_m",
    AddedMass: "position_m",
    Torque: "angle_rad",
    MassFlow: "pressure_pa",
    HeatFlow: "temperature_k",
}


def check_plant(plant: Plant) -> None:
    """See that a plant works, as far as its start shows it.

    Raises
    ------
    InputError
        With everything wrong of the first kind there is: causes that speak of what is not there,
        names, flows and signals that lead nowhere, what is not a number, what is not absent at
        null.
    UnknownQuantityError
        If a member reads what is not there.
    """
    for faults in (cause_faults, lost_names, lost_flows, lost_signals, not_numbers, not_absent):
        found = list(faults(plant))
        if found:
            raise InputError(*found)


def lost_names(plant: Plant) -> Iterator[Message]:
    """Optional outputs and inputs that are no quantity of the plant."""
    inputs = [signal.name for signal in plant.optional_inputs]
    asked = {"optional_outputs": plant.optional_outputs, "optional_inputs": inputs}
    for by, names in asked.items():
        for name in names:
            try:
                plant.model.conditions.read(name, by)
            except UnknownQuantityError as error:
                yield error.message


@dataclass(frozen=True, kw_only=True)
class Probe(Effect):
    """Flows of unknown size, to see what depends on them."""

    flows: tuple[Term, ...]

    def terms(self, now: Conditions) -> Iterable[Term]:
        return self.flows


def lost_flows(plant: Plant) -> list[Message]:
    """Flows into a balance that nothing depends on, each of a member, kind and balance once."""
    model = plant.model
    put = {
        (member.name, type(term), term.balance): term
        for member in plant.members
        for term in member.terms(model.conditions)
    }
    taken = _taken(plant, list(put.values()))
    return [
        _lost(model, source, kind, balance, taken[kind])
        for source, kind, balance in put
        if balance not in taken[kind] and not _unmoved(model, kind, balance)
    ]


def _taken(plant: Plant, terms: list[Term]) -> Mapping[type[Term], list[str]]:
    """Names of the balances that take a kind of flow: something depends on it there."""
    kinds = {type(term): term for term in (Force("", 0.0), Torque("", 0.0), *terms)}
    balances = dict.fromkeys([*(part.name for part in plant.parts), *(t.balance for t in terms)])
    asked = [(kind, balance) for kind in kinds for balance in balances]
    sizes = [ca.SX.sym(f"{kind.__name__} into {balance}") for kind, balance in asked]
    flows = (
        replace(kinds[kind], balance=balance, value=size)
        for (kind, balance), size in zip(asked, sizes, strict=True)
    )
    model = plant.with_effects(Probe(name="probe", flows=tuple(flows))).model
    inside = (value for _, value in model.conditions.named())
    everything = ca.vertcat(model.rates, model.outputs, *inside)
    taken: dict[type[Term], list[str]] = {kind: [] for kind in kinds}
    for k in sorted({*ca.jacobian_sparsity(everything, ca.vertcat(*sizes)).get_col()}):
        kind, balance = asked[k]
        taken[kind].append(balance)
    return taken


def _unmoved(model: Model, kind: type[Term], balance: str) -> bool:
    """True where what a flow would move is there, and no state has a part in it."""
    quantity = next((moved for each, moved in MOVED.items() if issubclass(kind, each)), "")
    value = dict(model.conditions.named()).get(f"{balance}.{quantity}")
    x = model.symbols[0]
    return value is not None and not (x.numel() and ca.depends_on(ca.SX(value), x))


def _lost(model: Model, source: str, kind: type[Term], balance: str, taken: list[str]) -> Message:
    word = kind.__name__
    said = f"which takes no {word}" if balance in model.conditions else "which is not there"
    what = f"{source} puts a {word} into {balance}, {said}"
    if not taken:
        return Message(what, expected=f"another kind of flow: nothing here takes a {word}")
    return Message(what, "", f"one of {listed(taken)}", nearest(balance, taken))


def lost_signals(plant: Plant) -> Iterator[Message]:
    """What members act on that is not theirs to act on: it would come through as it is."""
    sent = [s.name for s in (*plant.commands, *plant.measured_inputs, *plant.optional_inputs)]
    outputs = [*plant.measured, *plant.optional_outputs]
    inside = derived(plant)
    for member in plant.members:
        late = isinstance(member, Timing)  # that acts on what is recorded, not on what is inside
        known = list(dict.fromkeys((*sent, *outputs, *(() if late else inside))))
        named = _signals_of(member)
        for name in (name for name in named if name not in known):
            what = f"{member.name} acts on {name}, which is no signal of the plant"
            yield Message(what, "", f"one of {listed(known)}", nearest(name, known))
        if own(member) and _alters(member) and not named and not _altering(plant, member, known):
            what = f"{member.name} has an alter() that changes no signal of the plant"
            yield Message(what, "", f"one that changes one of {listed(known)}")


def _signals_of(member: Effect) -> list[str]:
    """Names of the signals that a member acts on, as the effects of the catalogue say them."""
    if not (_alters(member) or isinstance(member, Timing)):
        return []
    one, several = getattr(member, "signal", None), getattr(member, "signals", ())
    several = several if isinstance(several, tuple | list) else ()
    return [name for name in (one, *several) if isinstance(name, str)]


def _alters(member: Effect) -> bool:
    return type(member).alter is not Effect.alter


def _altering(plant: Plant, member: Effect, known: list[str]) -> bool:
    """Whether a member changes any of these signals with its strengths at their typical sizes."""
    strengths: dict[str, Any] = {
        k: v.typical for k, v in member.parameters().items() if v.null is not None
    }
    present = replace(member, **strengths)
    return any(name in known for name, _ in altered(plant.model, present))

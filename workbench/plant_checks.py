"""Whether what a user's own plant says arrives: its names, its flows and its signals.

The plants of the list are tested as they are.  A plant from a file is looked at here once it is
loaded, so that what would have no effect shows before the first run.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import casadi as ca

from workbench.cause_checks import cause_faults, own
from workbench.conditions import Conditions, UnknownQuantityError
from workbench.effect import AddedMass, Effect, Force, HeatFlow, MassFlow, Term, Torque
from workbench.effects.timing import Timing
from workbench.errors import InputError, Message, listed, nearest
from workbench.model import Model
from workbench.parts import Atmosphere, Supply
from workbench.plant import Plant
from workbench.plant_numbers import (
    altered,
    derived,
    is_number,
    not_absent,
    not_numbers,
    with_symbols,
)
from workbench.units import suffix

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
        for member in with_symbols(plant).members
        for term in member.terms(model.conditions)
    }
    taken = _taken(plant, list(put.values()))
    return [
        _lost(model, source, kind, balance, taken[kind])
        for source, kind, balance in put
        if balance not in taken[kind] and not _unmoved(plant, kind, balance)
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
    inside = (value for _, value in model.conditions.named() if is_number(value))
    everything = ca.vertcat(model.rates, model.outputs, *inside)
    taken: dict[type[Term], list[str]] = {kind: [] for kind in kinds}
    for k in sorted({*ca.jacobian_sparsity(everything, ca.vertcat(*sizes)).get_col()}):
        kind, balance = asked[k]
        taken[kind].append(balance)
    return taken


def _unmoved(plant: Plant, kind: type[Term], balance: str) -> bool:
    """True where what a flow would move is there, and goes its own way.

    So do a supply, a recording, and what a user's own part or effect says of it.
    """
    quantity = next((moved for each, moved in MOVED.items() if issubclass(kind, each)), "")
    value = dict(plant.model.conditions.named()).get(f"{balance}.{quantity}")
    if value is None or not is_number(value):
        return False
    for member in plant.members:
        if member.name == balance and (own(member) or isinstance(member, Supply | Atmosphere)):
            return True
    x = plant.model.symbols[0]
    return not (x.numel() and ca.depends_on(ca.SX(value), x))


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
        lost = [name for name in _signals_of(member) if name not in known]
        if lost and own(member) and _meant(plant, member, known):
            continue
        for name in lost:
            what = f"{member.name} acts on {name}, which is no signal of the plant"
            yield Message(what, "", f"one of {listed(known)}", nearest(name, known))


def _signals_of(member: Effect) -> list[str]:
    """Names of the signals that a member acts on, as the effects of the catalogue say them.

    Of a user's own only a single one: several may be a choice, of which not all are there.
    """
    if type(member).alter is Effect.alter and not isinstance(member, Timing):
        return []
    one, several = getattr(member, "signal", None), getattr(member, "signals", ())
    several = several if isinstance(several, tuple | list) and not own(member) else ()
    return [name for name in (one, *several) if isinstance(name, str)]


def _meant(plant: Plant, member: Effect, known: list[str]) -> bool:
    """Whether a user's own effect may well mean a name that is no signal of the plant.

    It does where the name is no full one, a prefix say, where it is a quantity that passes by
    unaltered here, and where the effect alters some signal all the same.
    """
    name = str(getattr(member, "signal", ""))
    there = any(name == quantity for quantity, _ in plant.model.conditions.named())
    changed = (
        n
        for each in with_symbols(plant).members
        if each.name == member.name
        for n, _ in altered(plant.model, each)
    )
    return not suffix(name) or there or any(n in known for n in changed)

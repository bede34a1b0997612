"""A plant: what is conserved, what flows, what goes in and what comes out."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from math import inf
from typing import Any

import casadi as ca
import numpy as np

from workbench.candidate import Candidate
from workbench.conditions import no_rate
from workbench.effect import Cause, Conditions, Effect, Expression, Parameter, Part, State, Term
from workbench.errors import UnknownNameError, nearest
from workbench.model import Model, flow_paths


@dataclass(frozen=True)
class Signal:
    """An input of the plant: a command, or a disturbance such as the supply pressure.

    ``levels`` are the only values that a switched input takes, none where it is continuous.
    ``measured`` among the commands is one that takes the place of what would produce it.
    """

    name: str
    nominal: float
    lower: float = -inf
    upper: float = inf
    levels: tuple[float, ...] = ()
    measured: bool = False


@dataclass(frozen=True, kw_only=True)
class Plant:
    """An actuator with its valve, as a list of parts and effects.

    A plant never changes; the ``with_...`` methods return new ones.  A part may only read parts
    that stand before it.  ``measured_inputs`` take the place of what would produce them: where the
    supply pressure is recorded, nothing computes it.  Absent effects stand in the list too: they
    are the catalogue of what the plant may lack, and cost nothing once :meth:`lean` drops them.
    ``origin`` says where a user's own plant comes from, ``file.py:function``.
    """

    name: str
    parts: tuple[Part, ...]
    effects: tuple[Effect, ...] = ()
    commands: tuple[Signal, ...] = ()
    measured_inputs: tuple[Signal, ...] = ()
    optional_inputs: tuple[Signal, ...] = ()
    measured: tuple[str, ...]
    optional_outputs: tuple[str, ...] = ()
    origin: str = ""

    def without(self, *names: str) -> Plant:
        """The same plant with the named effects taken out altogether."""
        require(names, [effect.name for effect in self.effects], self.name)
        return replace(self, effects=tuple(e for e in self.effects if e.name not in names))

    def with_effects(self, *effects: Effect) -> Plant:
        """The same plant with more effects."""
        return replace(self, effects=self.effects + effects)

    def with_values(self, values: Mapping[str, Expression]) -> Plant:
        """The same plant with other parameter values, by ``part.parameter_unit``."""
        require(values, self.values, self.name)
        changes: dict[str, dict[str, Any]] = defaultdict(dict)
        for name, value in values.items():
            member, _, parameter = name.rpartition(".")
            changes[member][parameter] = value

        def changed(member: Any) -> Any:  # the others stay the same objects: many plants are made
            return replace(member, **changes[member.name]) if member.name in changes else member

        parts, effects = (tuple(map(changed, group)) for group in (self.parts, self.effects))
        return replace(self, parts=parts, effects=effects)

    def with_measured_input(self, *names: str) -> Plant:
        """The same plant with optional inputs taken from a recording.

        Effects that would produce such an input are taken out.
        """
        require(names, [signal.name for signal in self.optional_inputs], self.name)
        taken = tuple(s for s in self.optional_inputs if s.name in names)
        kept = tuple(s for s in self.optional_inputs if s.name not in names)
        effects = tuple(e for e in self.effects if getattr(e, "produces", None) not in names)
        inputs = self.measured_inputs + taken
        return replace(self, measured_inputs=inputs, optional_inputs=kept, effects=effects)

    def with_inputs_commanded(self) -> Plant:
        """The same plant with its measured inputs behind its commands, as what is fed to it.

        An estimator is told commands alone, sample by sample.
        """
        taken = tuple(replace(signal, measured=True) for signal in self.measured_inputs)
        return replace(self, commands=self.commands + taken, measured_inputs=())

    def with_measured(self, *names: str) -> Plant:
        """The same plant with these outputs, in this order."""
        require(names, self.measured + self.optional_outputs, self.name)
        rest = tuple(n for n in self.measured + self.optional_outputs if n not in names)
        return replace(self, measured=tuple(names), optional_outputs=rest)

    def ready_for(self, candidate: Candidate) -> bool:
        """False where what the cause needs is itself absent, or was dropped as such."""
        name = candidate.needed
        if name is None:
            return True
        return name in self.values and self.values[name] != self.parameters[name].null

    def at_null(self, *candidates: Candidate) -> Plant:
        """The same plant with these causes absent."""
        known = self.parameters
        return self.with_values({c.strength: known[c.strength].null for c in candidates})

    def lean(self, keep: Iterable[str] = ()) -> Plant:
        """The same plant without what is absent, except in the members named in ``keep``.

        Asked again it is the same object, whose model is built once.
        """
        kept = frozenset(keep)
        if kept not in self._leaner:
            there = (e for e in self.effects if e.name in kept or not e.absent)
            effects = tuple(e if e.name in kept else e.reduced() for e in there)
            self._leaner[kept] = replace(self, effects=effects)
        return self._leaner[kept]

    def __getstate__(self) -> dict[str, Any]:
        """The fields alone: another process builds the model again, its symbols do not travel."""
        return {each.name: self.__dict__[each.name] for each in fields(self)}

    @cached_property
    def _leaner(self) -> dict[frozenset[str], Plant]:
        """What :meth:`lean` gave already, by what it kept."""
        return {}

    @property
    def members(self) -> tuple[Effect, ...]:
        """Parts, then effects."""
        return (*self.parts, *self.effects)

    def member(self, name: str) -> Effect:
        """The part or effect of this name, which is one of them."""
        return next(each for each in self.members if each.name == name)

    @cached_property
    def candidates(self) -> dict[str, Candidate]:
        """Every cause of the catalogue that this plant has a place for, by public name."""
        placed = (
            Candidate(cause, m.name, m.place or (m.name if _shared(cause, self) else None))
            for m in self.members
            for cause in m.causes
        )
        return {candidate.name: candidate for candidate in placed}

    @cached_property
    def values(self) -> dict[str, float]:
        """All parameter values, by ``part.parameter_unit``."""
        return {f"{m.name}.{key}": getattr(m, key) for m in self.members for key in m.parameters()}

    @cached_property
    def parameters(self) -> dict[str, Parameter]:
        """What is known of each parameter, by ``part.parameter_unit``."""
        return {f"{m.name}.{k}": v for m in self.members for k, v in m.parameters().items()}

    @cached_property
    def state_list(self) -> dict[str, State]:
        """Every state by its full name."""
        return {f"{m.name}.{s.quantity}": s for m in self.members for s in m.states()}

    @property
    def initial(self) -> np.ndarray:
        """Initial state, shape (n_x,)."""
        return np.array([float(s.initial) for s in self.state_list.values()])

    @cached_property
    def scale(self) -> np.ndarray:
        """Typical size of each state, shape (n_x,), not to be written to."""
        return _read_only(s.scale for s in self.state_list.values())

    @cached_property
    def nominal(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Nominal commands, measured inputs and parameters: shapes (n_u,), (n_d,) and (n_p,).

        They are asked for at every sample of a loop, and so kept; not to be written to.
        """
        u = _read_only(signal.nominal for signal in self.commands)
        d = _read_only(signal.nominal for signal in self.measured_inputs)
        return u, d, _read_only(self.values.values())

    @cached_property
    def model(self) -> Model:
        """The plant as expressions, with a symbol in place of every number."""
        p = _symbols(self.values)
        u = _symbols(signal.name for signal in self.commands)
        d = _symbols(signal.name for signal in self.measured_inputs)
        x = _symbols(self.state_list)
        plant = self.with_values(p)
        now = plant._conditions(x, u, d)
        flows = [(member.name, term) for member in plant.members for term in member.terms(now)]

        def received(balance: str) -> list[Term]:
            return [term for _, term in flows if term.balance == balance]

        for part in plant.parts:
            for quantity, value in part.close(now, received).items():
                now.place(f"{part.name}.{quantity}", value)
        rates = {
            f"{member.name}.{quantity}": rate
            for member in plant.members
            for quantity, rate in member.rates(now, received).items()
        }
        for name in x:
            if name not in rates:
                raise no_rate(name, rates)
        outputs = (plant._altered(n, now.read(n, "measured"), now) for n in self.measured)
        return Model(
            states=tuple(x),
            commands=tuple(u),
            measured_inputs=tuple(d),
            parameters=tuple(p),
            measured=self.measured,
            symbols=tuple(ca.vertcat(ca.SX(0, 1), *group.values()) for group in (x, u, d, p)),
            rates=ca.vertcat(ca.SX(0, 1), *(rates[name] for name in x)),
            outputs=ca.vertcat(*outputs),
            flows=_by_name(flows),
            paths=flow_paths(flows),
            tolerances=np.array([s.tolerance for s in self.state_list.values()]),
            conditions=now,
        )

    def _conditions(
        self, x: Mapping[str, ca.SX], u: Mapping[str, ca.SX], d: Mapping[str, ca.SX]
    ) -> Conditions:
        """All quantities at one instant; commands and sources pass the effects that alter them."""
        now = Conditions()
        given = d | {s.name: u[s.name] for s in self.commands if s.measured}
        for name, symbol in (x | given).items():
            now.place(name, symbol)
        for part in self.parts:
            for quantity, value in part.derive(now).items():
                name = f"{part.name}.{quantity}"
                if name not in given:
                    now.place(name, self._altered(name, value, now))
        for name, symbol in u.items():
            if name not in given:
                now.place(name, self._altered(name, symbol, now))
        return now

    def _altered(self, signal: str, value: Expression, now: Conditions) -> Expression:
        for member in self.members:
            value = member.alter(signal, value, now)
        return value


def require(names: Iterable[str], known: Iterable[str], owner: str) -> None:
    """Refuse names that are not known, with the nearest one that is.

    Raises
    ------
    UnknownNameError
        Naming the first unknown name, the nearest known one and all known ones.
    """
    known = dict.fromkeys(known)  # in their order, and quickly asked
    for name in names:
        if name not in known:
            near = nearest(name, known)
            hint = f"; did you mean {near}?" if near else ""
            raise UnknownNameError(f"{owner} has no {name}{hint} (it has {', '.join(known)})")


def _shared(cause: Cause, plant: Plant) -> bool:
    """True when several members carry this cause, so that its name needs a place."""
    return sum(c.name == cause.name for m in plant.members for c in m.causes) > 1


def _read_only(values: Iterable[float]) -> np.ndarray:
    found = np.array([*values], dtype=float)
    found.flags.writeable = False
    return found


def _symbols(names: Iterable[str]) -> dict[str, ca.SX]:
    return {name: ca.SX.sym(name) for name in names}


def _by_name(flows: list[tuple[str, Term]]) -> dict[tuple[str, str, str], Expression]:
    """Sum of the terms of each member, kind and balance."""
    sums: dict[tuple[str, str, str], Expression] = defaultdict(float)
    for source, term in flows:
        sums[source, type(term).__name__, term.balance] += term.value
    return dict(sums)

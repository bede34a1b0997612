"""What a rig does not have yet: causes that are absent, and forms of which nothing is known."""

from __future__ import annotations

from collections.abc import Iterable

from workbench.candidate import Candidate
from workbench.errors import InputError, Message
from workbench.plant import Plant, require
from workbench.rig import Rig
from workbench.units import public_name


def is_new(rig: Rig, candidate: Candidate) -> bool:
    """True for a cause that is absent from the rig's plant, not a shift of what it has."""
    known = rig.plant.parameters[candidate.strength]
    absent = rig.plant.values.get(candidate.strength, known.null) == known.null
    return candidate.held is None and absent


def unknown_forms(rig: Rig, candidates: Iterable[Candidate]) -> tuple[str, ...]:
    """Full names of the forms of what is absent from the rig.

    A fit begins them somewhere and keeps them in a range; nobody believed anything of them.  What
    the rig's plant has no place for, as an empirical term, is left out.
    """
    singles = (each for candidate in candidates for each in candidate.singles)
    placed = (each for each in singles if each.strength in rig.plant.parameters)
    return tuple(name for each in placed if is_new(rig, each) for name in each.forms)


def require_place(rig: Rig, plant: Plant, names: Iterable[str]) -> None:
    """Refuse what the rig's plant has no place for as it is recorded, ``plant``.

    Raises
    ------
    InputError
        If the recordings measure what the effect would produce.
    UnknownNameError
        If there is no place with any recording, with the nearest name.
    """
    for name in names:
        if name in rig.plant.candidates and name not in plant.candidates:
            effect = rig.plant.member(rig.plant.candidates[name].member)
            made = public_name(getattr(effect, "produces", ""))
            what = f"is not applicable: {made or 'what it would produce'} is measured"
            expected = "recordings without that channel; take it out of [recording.channels]"
            raise InputError(Message(what, name, expected))
    require(names, plant.candidates, plant.name)

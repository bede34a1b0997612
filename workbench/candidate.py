"""What a plant may lack: one cause at one place, or two that act together."""

from __future__ import annotations

from dataclasses import dataclass

from workbench.effect import Cause

TOGETHER = " + "  # between the names of two effects that are put in together


@dataclass(frozen=True)
class Candidate:
    """A cause as it sits in one plant: ``chamber_leak`` at ``chamber_a``.

    name        public name with place, ``chamber_leak@chamber_a``
    strength    full name of the strength parameter
    forms       full names of the parameters fitted with it
    """

    cause: Cause
    member: str
    place: str | None

    @property
    def name(self) -> str:
        return f"{self.cause.name}@{self.place}" if self.place else self.cause.name

    @property
    def strength(self) -> str:
        return f"{self.member}.{self.cause.strength}"

    @property
    def forms(self) -> tuple[str, ...]:
        return tuple(f"{self.member}.{key}" for key in self.cause.forms)

    @property
    def moved(self) -> tuple[str, ...]:
        """Full names of the parameters that adding it sets free: strength, forms, what it holds."""
        return tuple(name for name in (self.strength, *self.forms, self.held) if name)

    @property
    def held(self) -> str | None:
        """Full name of the fitted parameter that this cause shifts, if it shifts one."""
        return f"{self.member}.{self.cause.held}" if self.cause.held else None

    @property
    def needed(self) -> str | None:
        """Full name of the parameter without which this cause is nothing, if there is one."""
        return f"{self.member}.{self.cause.needs}" if self.cause.needs else None

    @property
    def singles(self) -> tuple[Candidate, ...]:
        """The causes that it puts into a plant: itself, or both of a pair."""
        return (self,)


@dataclass(frozen=True)
class CandidatePair(Candidate):
    """Two causes that are put into a plant together; all of the second goes with the first."""

    second: Candidate

    @property
    def first(self) -> Candidate:
        return Candidate(self.cause, self.member, self.place)

    @property
    def name(self) -> str:
        return f"{self.first.name}{TOGETHER}{self.second.name}"

    @property
    def forms(self) -> tuple[str, ...]:
        return (*self.first.forms, self.second.strength, *self.second.forms)

    @property
    def singles(self) -> tuple[Candidate, ...]:
        return (self.first, self.second)


def together(first: Candidate, second: Candidate) -> CandidatePair:
    """Two causes as one candidate."""
    return CandidatePair(first.cause, first.member, first.place, second)

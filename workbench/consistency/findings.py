"""What is found wrong with a recording as a recording of this rig."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from workbench.errors import Message


class Weight(Enum):
    """What follows from a finding.

    REFUSED   nothing may be concluded from the recording as it is read: exit 2
    DOUBT     conclusions are drawn, but a diagnosis calls nothing ``found``
    NOTICE    worth knowing
    """

    REFUSED = "refused"
    DOUBT = "doubt"
    NOTICE = "notice"


@dataclass(frozen=True)
class Finding:
    """One thing that does not fit.

    weight      what follows from it
    recording   where: the file, or the name where it comes from none
    channel     public name of the channel, or of all that are concerned
    what        what is seen, with its evidence in numbers
    remedy      what to do about it
    """

    weight: Weight
    recording: str
    channel: str
    what: str
    remedy: str

    @property
    def message(self) -> Message:
        """As an error names it."""
        return Message(f"{self.what}; {self.remedy}", self.channel, file=self.recording)

    def __str__(self) -> str:
        return f"{self.recording}: {self.channel}: {self.what}; {self.remedy}"

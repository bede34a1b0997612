"""The plants that have a truth, each with what a study asks of it; a new one is one entry here."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from studies.truth import (
    crr_rig_draw,
    crr_rig_misfit,
    crr_rig_record,
    draw,
    gearbox_draw,
    gearbox_record,
    misfit,
    record,
    rule,
    soft_joint_draw,
    soft_joint_record,
)
from studies.truth.case import Case

Table = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Truth:
    """The truth of one plant.

    plant               name of the plant, as cases carry it
    hidden              effects of the catalogue that a case may hide, by the truth's names
    outside_catalogue   laws that no catalogue has
    stored              file of the drawn cases
    draw                case of an effect (None for nothing hidden) and seed, before the misfit rule
    draw_size           size of an effect
    misfits             misfit of the hidden effect and of every difference
    record              training and validation table of each case
    """

    plant: str
    hidden: tuple[str, ...]
    outside_catalogue: tuple[str, ...]
    stored: Path
    draw: Callable[[str | None, int], Case]
    draw_size: rule.DrawSize
    misfits: rule.Measure
    record: Callable[[Sequence[Case]], list[tuple[Table, Table]]]

    def scaled(self, cases: Sequence[Case]) -> list[Case]:
        """Cases that meet the misfit rule."""
        return rule.scaled(cases, self.misfits, self.draw_size)

    @property
    def names(self) -> tuple[str | None, ...]:
        """All that a case may hide, and None for nothing."""
        return (*self.hidden, *self.outside_catalogue, None)


def _stored(name: str) -> Path:
    return Path(__file__).with_name(name)


SERVO_DRIVE = Truth(
    plant="servo_drive",
    hidden=draw.HIDDEN,
    outside_catalogue=draw.OUTSIDE_CATALOGUE,
    stored=_stored("cases.json"),
    draw=draw.draw,
    draw_size=draw.draw_size,
    misfits=misfit.misfits,
    record=record.record,
)
CRR_RIG = Truth(
    plant=crr_rig_draw.PLANT,
    hidden=crr_rig_draw.HIDDEN,
    outside_catalogue=crr_rig_draw.OUTSIDE_CATALOGUE,
    stored=_stored("cases_crr_rig.json"),
    draw=crr_rig_draw.draw,
    draw_size=crr_rig_draw.draw_size,
    misfits=crr_rig_misfit.misfits,
    record=crr_rig_record.record,
)
SOFT_JOINT = Truth(
    plant=soft_joint_draw.PLANT,
    hidden=soft_joint_draw.HIDDEN,
    outside_catalogue=soft_joint_draw.OUTSIDE_CATALOGUE,
    stored=_stored("cases_soft_joint.json"),
    draw=soft_joint_draw.draw,
    draw_size=soft_joint_draw.draw_size,
    misfits=soft_joint_record.misfits,
    record=soft_joint_record.record,
)
GEARBOX = Truth(
    plant=gearbox_draw.PLANT,
    hidden=gearbox_draw.HIDDEN,
    outside_catalogue=gearbox_draw.OUTSIDE_CATALOGUE,
    stored=_stored("cases_gearbox.json"),
    draw=gearbox_draw.draw,
    draw_size=gearbox_draw.draw_size,
    misfits=gearbox_record.misfits,
    record=gearbox_record.record,
)
TRUTHS = {truth.plant: truth for truth in (SERVO_DRIVE, CRR_RIG, SOFT_JOINT, GEARBOX)}

"""Ties that end where one leaves the noise and another clearly more, on both recordings."""

from dataclasses import replace

import numpy as np
import pytest
from test_report import diagnosis

from workbench.diagnosis import told_apart as module
from workbench.diagnosis.ranking import grouped
from workbench.diagnosis.told_apart import told_apart

NOISE, LITTLE, MORE = 1.0, 1.4, 2.2  # levels: more is clearly more than little, and little not
FAR = 1.6  # what leaves it does not explain a recording


def tied(count=3):
    """Rows that do the same, the first of them the leader, and one that does not."""
    row = replace(diagnosis().ranking[0], fit=object(), validation=object(), accepted=True)
    names = ["command_delay", "valve_lag", "line_delay", "sensor_lag", "valve_hysteresis"]
    cause = row.candidate.cause
    rows = [
        replace(row, candidate=replace(row.candidate, cause=replace(cause, name=name), place=None))
        for name in names[: count + 1]
    ]
    return (*grouped(rows[:count]), replace(rows[count], tied_with=(), crowd=()))


def told(monkeypatch, rows, *levels):
    """The names that are left in the tie, the leader first, with these levels of both sets."""
    known = {
        row.candidate.name: {"train": np.log(train), "validation": np.log(unseen)}
        for row, (train, unseen) in zip(rows, levels, strict=False)
    }
    monkeypatch.setattr(module, "on_its_own_yardstick", lambda row: row)
    monkeypatch.setattr(module, "_levels", lambda row: known[row.candidate.name])
    found = told_apart(rows)
    assert sorted(r.candidate.name for r in found) == sorted(r.candidate.name for r in rows)
    for row in found[1 + len(found[0].alike) :]:
        assert not row.alike
    return [found[0].candidate.name, *found[0].alike]


@pytest.mark.parametrize(
    ("lag", "line", "stay"),
    [
        ((MORE, MORE), (MORE, MORE), ["command_delay"]),
        ((MORE, MORE), (LITTLE, MORE), ["command_delay", "line_delay"]),
        ((MORE, LITTLE), (LITTLE, LITTLE), ["command_delay", "valve_lag", "line_delay"]),
    ],
)
def test_what_leaves_clearly_more_of_both_recordings_leaves_the_tie(monkeypatch, lag, line, stay):
    assert told(monkeypatch, tied(), (NOISE, NOISE), lag, line) == stay


def test_where_all_leave_more_than_noise_nobody_is_told_apart(monkeypatch):
    """Something else is there too: who leaves less of that may be the wrong one."""
    far = (FAR, FAR)

    assert len(told(monkeypatch, tied(), far, (9.0, 9.0), (9.0, 9.0))) == 3


def test_a_leader_that_leaves_clearly_more_gives_way_and_a_crowd_may_become_a_tie(monkeypatch):
    rows = tied(4)
    assert rows[0].crowd == ("sensor_lag",)

    left = told(monkeypatch, rows, (MORE, MORE), (LITTLE, NOISE), (NOISE, NOISE), (MORE, MORE))

    assert left == ["line_delay", "valve_lag"]


def test_of_one_alone_and_without_a_held_out_recording_nothing_is_said(monkeypatch):
    rows = tied()
    unseen = tuple(replace(row, validation=None) for row in rows)

    assert told_apart(unseen) is unseen
    assert told_apart((replace(rows[3]),)) == (rows[3],)

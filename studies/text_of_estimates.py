"""Estimators side by side as text and as JSON."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from studies.plain import plain
from studies.text import columns, number, percent, shown
from workbench.units import public_name, si_unit

if TYPE_CHECKING:
    from studies.estimated import Estimated, EstimatedRecording

DEFINED = (
    "nis: innovation squared over its covariance per output, 1 if consistent; coloured: lags at "
    "which innovations are correlated, 5 % if white"
)


def estimates_text(found: Iterable[EstimatedRecording]) -> str:
    """Tables of each recording: prediction, states where the truth is known, holes."""
    return "\n\n".join(_recording_text(each) for each in found)


def _recording_text(each: EstimatedRecording) -> str:
    noise = ", ".join(
        f"{public_name(name)} {shown(value, name, 3)}" for name, value in each.noise.items()
    )
    tuned = ", ".join(f"{group} x {factor:.3g}" for group, factor in each.tuned.factors.items())
    gain = each.tuned.log_likelihood - each.tuned.before
    return "\n".join(
        (
            f"{each.name}: {len(each.truth) * each.sample_time_s:.4g} s",
            f"sensor noise: {noise}",
            f"process noise by likelihood: {tuned} (log-likelihood + {gain:.4g})",
            "",
            "on the recording: RMS error of what is foretold from an estimate",
            _predictions(each),
            DEFINED,
            "",
            f"on the rig's plant under the recorded inputs: RMS error by state, and with "
            f"{each.hidden} hidden",
            _states(each),
            _seen(each),
            "",
            "the same with data that lack something: RMS error of outputs",
            _disturbed(each),
            *(f"{name}: {why}" for name, why in each.lost.items()),
        )
    )


def _predictions(each: EstimatedRecording) -> str:
    horizons = [*each.rows[0].horizons]
    head = ["estimator", "output", *(f"{1e3 * h:g} ms" for h in horizons)]
    head += ["nis", "coloured", "median ms", "p99 ms"]
    lines = [
        [
            row.name,
            public_name(name),
            *(shown(row.horizons[h][k], name, 3) for h in horizons),
            number(row.nis, 3),
            percent(row.coloured[k]),
            number(1e3 * row.median_s, 3),
            number(1e3 * row.p99_s, 3),
        ]
        for row in each.rows
        for k, name in enumerate(each.outputs)
    ]
    return columns(head, lines)


def _states(each: EstimatedRecording) -> str:
    names = list(dict.fromkeys(name for row in each.rows for name in row.state_rmse))
    head = [
        "state",
        "known to",
        *(f"{row.name}{what}" for row in each.rows for what in ("", " hidden")),
    ]
    known = each.observed.within
    lines = [
        [public_name(name), shown(known.get(name, np.nan), name, 2), *_of_state(each, name)]
        for name in names
    ]
    return columns(head, lines)


def _disturbed(each: EstimatedRecording) -> str:
    head = ["output", "what the data lack", *(row.name for row in each.rows)]
    lines = [
        [public_name(name), what, *(shown(row.disturbed[what][k], name, 3) for row in each.rows)]
        for k, name in enumerate(each.outputs)
        for what in each.rows[0].disturbed
    ]
    return columns(head, lines)


def _seen(each: EstimatedRecording) -> str:
    """Which states the outputs do not determine."""
    outputs, unseen = (", ".join(map(public_name, v)) for v in (each.outputs, each.observed.unseen))
    told = "known to: least standard deviation that the outputs allow, given model and noise\n"
    if not unseen:
        return f"{told}every state is seen by {outputs}"
    return f"{told}not observable from {outputs}: {unseen}"


def _of_state(each: EstimatedRecording, name: str) -> list[str]:
    pairs = ((row.state_rmse, row.hidden_rmse) for row in each.rows)
    return [shown(found.get(name, np.nan), name, 3) for pair in pairs for found in pair]


def estimates_document(rig: str, found: Iterable[EstimatedRecording]) -> dict[str, Any]:
    """The same numbers in SI for JSON; what is no number is null."""
    return {
        "schema": "workbench.estimates/1",
        "rig": rig,
        "recordings": [_recording_document(each) for each in found],
    }


def _recording_document(each: EstimatedRecording) -> dict[str, Any]:
    return {
        "recording": each.name,
        "sample_time_s": each.sample_time_s,
        "noise": {public_name(n): _value(v, n) for n, v in each.noise.items()},
        "process_noise_factors": dict(each.tuned.factors),
        "hidden": each.hidden,
        "known_to": {public_name(n): _value(v, n) for n, v in each.observed.within.items()},
        "not_observable": [public_name(name) for name in each.observed.unseen],
        "lost": dict(each.lost),
        "estimators": [_row_document(each, row) for row in each.rows],
    }


def _row_document(each: EstimatedRecording, row: Estimated) -> dict[str, Any]:
    outputs = each.outputs
    return {
        "estimator": row.name,
        "prediction_rmse": {
            f"{horizon:g} s": {
                public_name(n): _value(v, n) for n, v in zip(outputs, errors, strict=True)
            }
            for horizon, errors in row.horizons.items()
        },
        "nis": plain(row.nis),
        "coloured": {public_name(n): plain(v) for n, v in zip(outputs, row.coloured, strict=True)},
        "latency_s": {"median": row.median_s, "p99": row.p99_s},
        "state_rmse": {public_name(n): _value(v, n) for n, v in row.state_rmse.items()},
        "state_rmse_hidden": {public_name(n): _value(v, n) for n, v in row.hidden_rmse.items()},
        "disturbed_rmse": {
            what: {public_name(n): _value(v, n) for n, v in zip(outputs, errors, strict=True)}
            for what, errors in row.disturbed.items()
        },
    }


def _value(value: float, name: str) -> dict[str, Any]:
    return {"value": plain(value), "unit": si_unit(name)}

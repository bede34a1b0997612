"""What the study of estimators claims, and its tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import nan, sqrt
from typing import Any

import numpy as np
from scipy.stats import t as student

from studies.estimator_runs import BAND, band
from studies.study import Claim
from studies.text import columns, number, percent

ALL = ("kalman", "ekf", "ukf", "imm", "mhe")
REDUCED = ("kalman", "imm")  # leave out parts of the plant; their noise is tuned by themselves
LINEAR = ("kalman",)
WHY_LINEAR = (
    "kalman is reported, not judged: linear modes have no bristle, on which the slide swings for "
    "20 ms when it stops, and no impacts, from which the piston of the gearbox bounces"
)
HALF, NEAR_PA = 0.5, 0.15e5
HELD = ("stick", "held", "stop")  # in the names of modes that do not move
NAMED = 0.95
DEGREES = 4  # position, velocity, two pressures
OUTPUTS = 3
Rows = Sequence[Mapping[str, Any]]


def courses(rows: Sequence[Mapping[str, Any]]) -> tuple[np.ndarray, np.ndarray]:
    """Mean over the runs that move at a sample, NaN where fewer than half do, and how many."""
    values, moving = (np.array([row[key] for row in rows]) for key in ("nees", "moving"))
    there = moving.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(there >= len(rows) / 2, (values * moving).sum(axis=0) / there, np.nan)
    return mean, there


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Mean NEES and NIS in motion with their bands, and the share of samples inside their own.

    A sample's band is that of as many independent values as there are runs.  All samples of a run
    tell more, but not as much as if they were independent: runs are, so the spread of their means
    says how far the mean of these may lie from what is exact.
    """
    values, nis, moving = (
        np.array([row[key] for row in rows], dtype=float) for key in ("nees", "nis", "moving")
    )
    mean, there = courses(rows)
    judged = [(m, *band(DEGREES, n)) for m, n in zip(mean, there, strict=True) if np.isfinite(m)]
    inside = [low <= m <= high for m, low, high in judged]
    found, low, high = _of_runs(values, moving, DEGREES)
    nis_found, nis_low, nis_high = _of_runs(nis, moving, OUTPUTS)
    return {
        "nees": found,
        "low": low,
        "high": high,
        "inside": float(np.mean(inside)) if inside else float("nan"),
        "nis": nis_found,
        "nis_low": nis_low,
        "nis_high": nis_high,
        "runs": len(rows),
    }


def _of_runs(values: np.ndarray, moving: np.ndarray, exact: float) -> tuple[float, float, float]:
    """Mean of the runs' means in motion, and the band about what is exact by their spread.

    Student's at 95 %; both ends are NaN of a single run, whose spread nobody knows.
    """
    pairs = zip(values, moving > 0, strict=True)
    means = np.array([row[there].mean() for row, there in pairs if there.any()])
    n = len(means)
    half = nan if n < 2 else student.ppf(0.5 + BAND / 2.0, n - 1) * means.std(ddof=1) / sqrt(n)
    return float(means.mean()), float(max(exact - half, 0.0)), float(exact + half)


def velocity_claims(found: Mapping[str, Mapping[str, float]]) -> Iterator[Claim]:
    for plant, rows in found.items():
        told = ", ".join(f"{name} {number(rows[name] / rows['derivative'], 3)}" for name in ALL)
        yield Claim(
            f"{plant}: velocity error of EKF, UKF, IMM and MHE below half of the filtered "
            "derivative's",
            told,
            all(rows[n] < HALF * rows["derivative"] for n in ALL if n not in LINEAR),
        )


def position_claims(found: Mapping[str, Mapping[str, Any]]) -> Iterator[Claim]:
    for plant, each in found.items():
        worst = max(max(row["a"], row["b"]) for row in each["runs"])
        seen = each["observability"]
        yield Claim(
            f"{plant}, {each['estimator'].upper()} by position alone: pressures in motion within "
            "0.15 bar",
            f"{1e-5 * worst:.3f} bar RMS in the worst of {len(each['runs'])} runs",
            worst < NEAR_PA,
        )
        yield Claim(
            f"{plant}, position alone: all modes that move are observable",
            f"{seen['whole']} of {seen['modes']} modes; not: where something holds what moves",
            all(any(word in name for word in HELD) for name in seen["not"]),
        )


def consistency_claims(found: Mapping[str, Sequence[Mapping[str, Any]]]) -> Iterator[Claim]:
    for name, rows in found.items():
        s = summary(rows)
        yield Claim(
            f"{name}: NEES over {s['runs']} runs inside its 95 % band",
            f"{s['nees']:.2f} of {s['low']:.2f} to {s['high']:.2f}; {percent(s['inside'])} of the "
            "samples inside theirs",
            s["low"] <= s["nees"] <= s["high"],
        )


def mode_claims(found: Mapping[str, Mapping[str, float]]) -> Iterator[Claim]:
    for what, row in found.items():
        yield Claim(
            f"IMM names {what} in 95 % of samples", percent(row["share"], 1), row["share"] >= NAMED
        )


def velocity_text(found: Mapping[str, Mapping[str, float]]) -> str:
    head = ("velocity RMSE m/s, drawn truth", "derivative", *ALL)
    lines = [
        (plant, *(number(rows[name], 3) for name in ("derivative", *ALL)))
        for plant, rows in found.items()
    ]
    best = "the derivative has the lag that is best for it; - lost"
    return f"{columns(head, lines)}\n{best}\n{WHY_LINEAR}"


def consistency_text(
    found: Mapping[str, Mapping[str, Rows]], coloured: Mapping[str, Mapping[str, float]]
) -> str:
    """NEES and NIS with their bands, and whiteness, by truth and estimator."""
    head = ("truth", "estimator", "runs", "NEES", "band", "samples inside", "NIS", "band",
            "coloured lags")  # fmt: skip
    lines = []
    for kind, rows in found.items():
        for name, several in rows.items():
            s = summary(several)
            lines.append(
                (kind, name, str(s["runs"]), number(s["nees"], 3),
                 f"{s['low']:.2f} to {s['high']:.2f}", percent(s["inside"]),
                 number(s["nis"], 3), f"{s['nis_low']:.2f} to {s['nis_high']:.2f}",
                 percent(coloured[kind][name]))
            )  # fmt: skip
    return (
        f"{columns(head, lines)}\nposition, velocity and pressures in motion, on average over "
        "runs, in bands by the spread of their means; drawn parameters are not judged; 5 % of the "
        "lags are coloured if innovations are white"
    )


def position_text(found: Mapping[str, Mapping[str, Any]]) -> str:
    head = ("by position alone", "estimator", "whole state seen", "runs", "pressures RMSE bar",
            "worst run")  # fmt: skip
    lines = []
    for plant, each in found.items():
        values = [[1e-5 * row[key] for row in each["runs"]] for key in "ab"]
        every, worst = (
            " and ".join(number(f(v), 3) for v in values)
            for f in (lambda v: float(np.sqrt(np.mean(np.square(v)))), max)
        )
        seen = each["observability"]
        told = f"{seen['whole']} of {seen['modes']} modes"
        lines.append((plant, each["estimator"], told, str(len(each["runs"])), every, worst))
    return (
        f"{columns(head, lines)}\nin motion, started half a bar off; modes that hold what moves "
        "show no pressure"
    )


def modes_text(found: Mapping[str, Mapping[str, float]]) -> str:
    head = ("IMM names", "right", "counted", "phases")
    lines = [
        (what, percent(r["share"], 1), percent(r["counted"]), f"{r['phases']:.0f}")
        for what, r in found.items()
    ]
    return f"{columns(head, lines)}\nwithout the first 10 ms of each phase"

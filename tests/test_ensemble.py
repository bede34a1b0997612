"""Runs side by side give what CasADi gives, to the last bit, and are never needed."""

import ctypes
import logging
import os
import pickle
import shutil
from copy import deepcopy
from dataclasses import replace
from itertools import product
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from conftest import drawn
from test_compiled import HAS_COMPILER, cache, needs_compiler  # noqa: F401

from workbench.compiled import COMPILERS
from workbench.ensemble import ensemble
from workbench.fitting.windows import cut_windows
from workbench.lanes import OPERATIONS, NoLanesError, address, lane_library, lanes_of
from workbench.recording import Recording

DT, LENGTH = 1e-3, 12
NUMBERS = [
    -np.inf,
    -3.5,
    -1.0,
    -0.5,
    -1e-310,
    -0.0,
    0.0,
    1e-310,
    0.5,
    1.0,
    2.0,
    1e9,
    np.inf,
    np.nan,
]
EACH = """
int lanes(void) { return LANES; }
void each(long long n, const double *in, double *out) {
  for (long long k = 0; k < n; k += LANES) {
    v a[1], b[1], c[SIZE];
    for (int l = 0; l < LANES; l++) { a[0][l] = in[2 * (k + l)]; b[0][l] = in[2 * (k + l) + 1]; }
    one(a, b, c);
    for (int i = 0; i < SIZE; i++) 
      for (int l = 0; l < LANES; l++) out[SIZE * (k + l) + i] = c[i][l];
  }
}
"""


def driver(folder, code, name="driver"):
    """A file with this C."""
    path = folder / f"{name}.c"
    path.write_text(code)
    return path


needs_lanes = pytest.mark.skipif(
    not HAS_COMPILER or os.environ.get("WORKBENCH_NO_COMPILER", "") not in ("", "0"),
    reason="there is no compiler here",
)


def bits(values):
    """What is to be equal: every number's own bits, of those that are none just that."""
    return np.where(np.isnan(values), np.uint64(1), np.asarray(values).view(np.uint64))


def every_operation():
    """(a, b) -> all operations that have lanes."""
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    single = [ca.sqrt, ca.fabs, ca.exp, ca.log, ca.sin, ca.cos, ca.tan, ca.asin, ca.acos, ca.atan]
    single += [ca.sinh, ca.cosh, ca.tanh, ca.floor, ca.ceil, ca.sign, ca.log1p, ca.expm1]
    single += [lambda x: -x, lambda x: 1.0 / x, lambda x: x * x, lambda x: 2.0 * x, ca.logic_not]
    single += [lambda x: x**2.5, lambda x: x + 0.1]
    double = [ca.plus, ca.minus, ca.times, ca.rdivide, ca.power, ca.atan2, ca.hypot, ca.copysign]
    double += [ca.fmin, ca.fmax, ca.lt, ca.le, ca.eq, ca.ne, ca.logic_and, ca.logic_or]
    double += [lambda x, y: ca.if_else(x, y, 0.0), lambda x, y: ca.if_else(x < y, x, y)]
    results = [f(a) for f in single] + [f(a, b) for f in double]
    return ca.Function("every", [a, b], [ca.vertcat(*results)])


@needs_lanes
def test_every_operation_is_that_of_casadi_to_the_last_bit(tmp_path):
    every = every_operation()
    points = np.array([*product(NUMBERS, repeat=2), *[(1.0, 2.0)] * 4])
    assert len(points) % 8 == 0
    code = driver(tmp_path, EACH)
    library = lane_library(code, {"SIZE": every.numel_out(0)}, {"one": every})
    found = np.empty((len(points), every.numel_out(0)))
    library.each(ctypes.c_longlong(len(points)), address(points), address(found))

    expected = np.array([every(*point).full().ravel() for point in points])

    asked = {every.instruction_id(k) for k in range(every.n_instructions())}
    assert asked >= set(OPERATIONS) - {ca.OP_ASSIGN}
    np.testing.assert_array_equal(bits(found), bits(expected))


def cut(plant, dt, n=5, length=LENGTH):
    """Windows over a recording of random commands, and random start states for each."""
    found = drawn(plant, n * length, seed=5)
    names = (*plant.model.commands, *plant.model.measured_inputs)
    rows = dict(zip(names, np.vstack([found.u, found.d]), strict=True))
    rows |= {name: np.zeros(n * length) for name in plant.measured}
    noise = dict.fromkeys(plant.measured, 1.0)
    windows = cut_windows(plant, [Recording("random", dt, rows)], noise, length * dt)
    return windows, found.x[:, ::length]


def with_something_missing(plant, most=5):
    """The plant, and as it is with one of its candidates in a typical size."""
    known = plant.parameters
    strengths = [(c.strength, known[c.strength]) for c in plant.candidates.values()]
    sizes = [{name: (k.null or 0.0) + 0.3 * k.typical} for name, k in strengths]
    return [plant, *(plant.with_values(size) for size in sizes[:most])]


@needs_lanes
@pytest.mark.parametrize("dt", [DT, 2.5e-3])
def test_every_plant_runs_in_lanes_to_the_last_bit(plant, dt, monkeypatch):
    """Half a typical size off rest pistons strike their ends, and steps are refined.

    A sample of 2.5 ms takes three steps.
    """
    windows, starts = cut(plant, dt)
    several = with_something_missing(plant)
    assert bool(plant.model.ensemble(dt)) == bool(plant.model.states)
    together = windows.simulated(several, starts)

    monkeypatch.setitem(plant.model._ensemble, dt, None)
    by_casadi = windows.simulated(several, starts)

    np.testing.assert_array_equal(bits(together), bits(by_casadi))


@needs_lanes
def test_what_has_run_travels_and_is_copied(drive):
    windows, starts = cut(drive, DT)
    expected = windows.simulated([drive], starts)

    for again in (pickle.loads(pickle.dumps(windows)), deepcopy(windows)):
        np.testing.assert_array_equal(again.simulated([again.plant], starts), expected)


@needs_lanes
def test_an_output_that_is_always_zero_keeps_its_row(drive):
    found, zero = drawn(drive, 4 * LENGTH), ca.SX(1, 1)
    model = replace(drive.model, outputs=ca.vertcat(zero, drive.model.outputs))
    model = replace(model, measured=("none", *model.measured))
    given = found.x[:, ::LENGTH], found.u, found.d, np.tile(found.p[:, None], 4), 1

    rows = model.ensemble(DT)(*given)

    assert not rows[0].any()
    np.testing.assert_array_equal(rows[1:], drive.model.ensemble(DT)(*given))


@needs_lanes
def test_which_runs_share_lanes_changes_nothing(drive):
    at = drawn(drive, 6 * LENGTH)
    given = at.x[:, ::LENGTH], at.u, at.d, np.tile(at.p[:, None], 6)
    run = drive.model.ensemble(DT)

    found = [run(*given, threads) for threads in (1, 2, 5)]

    for other in found[1:]:
        np.testing.assert_array_equal(bits(other), bits(found[0]))


@needs_lanes
def test_a_run_that_is_lost_takes_no_other_with_it(drive):
    found = drawn(drive, 4 * LENGTH)
    x, p = found.x[:, ::LENGTH].copy(), np.tile(found.p[:, None], 4)
    run = drive.model.ensemble(DT)
    whole = run(x, found.u, found.d, p, 2)
    x[:, 1] = np.nan

    after = run(x, found.u, found.d, p, 2)

    lost = np.repeat([False, True, False, False], LENGTH)
    assert np.isnan(after[:, lost]).any() and np.isfinite(after[:, ~lost]).all()
    np.testing.assert_array_equal(after[:, ~lost], whole[:, ~lost])


@needs_lanes
def test_a_run_of_one_sample_is_what_its_start_shows(drive):
    n = 11
    at = drawn(drive, n)
    p = np.tile(at.p[:, None], n)

    found = drive.model.ensemble(DT)(at.x[:, :n], at.u, at.d, p, 2)

    expected = drive.model.h.map(n)(at.x[:, :n], at.u, at.d, p).full()
    np.testing.assert_array_equal(bits(found), bits(expected))


@needs_lanes
def test_shapes_that_do_not_fit_are_refused(drive):
    found, run = drawn(drive, 2 * LENGTH), drive.model.ensemble(DT)
    x, p = found.x[:, ::LENGTH], np.tile(found.p[:, None], 2)
    with pytest.raises(ValueError, match="ensemble takes"):
        run(x, found.u, found.d, p[:, :1], 1)
    with pytest.raises(ValueError, match="given are 0"):
        run(x[:, :0], found.u[:, :0], found.d[:, :0], p[:, :0], 1)


def test_an_operation_without_lanes_is_named():
    x = ca.SX.sym("x")
    odd = ca.Function("odd", [x], [ca.erf(x)])
    with pytest.raises(NoLanesError, match=r"odd: CasADi's operation \d+ has no lanes"):
        lanes_of(odd, "odd")
    assert lane_library(Path("not asked for"), {}, {"odd": odd}) is None


def test_without_a_compiler_there_are_no_lanes(cache, monkeypatch, drive):  # noqa: F811
    monkeypatch.setenv("WORKBENCH_NO_COMPILER", "1")

    assert ensemble(drive.model, DT) is None


@needs_compiler
def test_what_does_not_compile_is_said_and_is_not_in_the_way(cache, caplog, tmp_path):  # noqa: F811
    assert lane_library(driver(tmp_path, "no C"), {}, {}) is None
    assert lane_library(driver(tmp_path, "no C, still"), {}, {}) is None
    assert [r.levelno for r in caplog.records] == [logging.WARNING]
    assert not list(cache.glob("*.so"))


@pytest.mark.skipif(not any(map(shutil.which, COMPILERS)), reason="no compiler on the path")
def test_a_compiler_that_does_not_know_its_own_machine_makes_lanes_too(
    cache,  # noqa: F811
    monkeypatch,
    tmp_path,
    caplog,
):
    """As Apple's of some years ago."""
    found = next(filter(shutil.which, COMPILERS))
    script = tmp_path / "older"
    script.write_text(
        '#!/bin/sh\ncase "$*" in *native*) echo no such machine >&2; exit 1;; esac\n'
        f'exec {found} "$@"\n'
    )
    script.chmod(0o755)
    monkeypatch.setenv("CC", str(script))

    code = driver(tmp_path, "int seven(void) { return 7; }")
    assert lane_library(code, {}, {}).seven() == 7
    assert not caplog.records


@needs_compiler
def test_a_damaged_library_of_lanes_is_made_once_more(cache, tmp_path):  # noqa: F811
    code = driver(tmp_path, "int seven(void) { return 7; }")
    lane_library(code, {}, {})
    (path,) = cache.glob("*.so")
    path.unlink()  # the old one is still open
    path.write_bytes(b"no library")

    assert lane_library(code, {}, {}).seven() == 7

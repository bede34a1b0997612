"""Work on many pieces: kept one by one, the same with any number of workers, also on a cluster."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager

import numpy as np
import pytest
from child_process import imports_alike
from commands import call

from studies.kept import Kept
from studies.workers import Workers
from workbench.errors import InputError

PIECES = {f"piece {k}": k for k in range(8)}


def silent(done, of):
    pass


def drawn(k):
    """What a draw gives: numbers of its own seed."""
    return {"value": float(np.random.default_rng(k).standard_normal())}


def fails_at_five(k):
    if k == 5:
        raise ArithmeticError("no plant")
    return drawn(k)


def test_rows_are_the_same_however_many_workers_there_are(tmp_path):
    one = Workers(1).keep(Kept(tmp_path / "one"), drawn, PIECES, silent)
    two = Workers(2).keep(Kept(tmp_path / "two"), drawn, PIECES, silent)

    assert [row["value"] for row in one] == [drawn(k)["value"] for k in PIECES.values()]
    assert one == two


def test_what_is_kept_is_not_done_again(tmp_path):
    path = tmp_path / "rows"
    with pytest.raises(ArithmeticError, match="no plant"):
        Workers(1).keep(Kept(path), fails_at_five, PIECES, silent)
    kept, done = Kept(path), []
    assert set(kept.rows) == {f"piece {k}" for k in range(5)}

    def noted(k):
        done.append(k)
        return drawn(k)

    told = []
    rows = Workers(1).keep(kept, noted, PIECES, lambda *counts: told.append(counts))

    assert done == [5, 6, 7]
    assert told == [(5, 8), (6, 8), (7, 8), (8, 8)]
    assert [row["value"] for row in rows] == [drawn(k)["value"] for k in PIECES.values()]


SLOW_WORK = """
import sys, time
from pathlib import Path
from studies.kept import Kept
from studies.workers import Workers

def slow(k):
    time.sleep(0.1)
    return {"value": k}

if __name__ == "__main__":
    pieces = {f"piece {k}": k for k in range(40)}
    Workers(2).keep(Kept(Path(sys.argv[1])), slow, pieces, lambda done, of: None)
"""


def test_a_kill_loses_what_is_running_and_no_more(tmp_path):
    script, path = tmp_path / "slow.py", tmp_path / "rows"
    script.write_text(SLOW_WORK, encoding="utf-8")
    around = imports_alike()
    command = [sys.executable, str(script), str(path)]
    begun = subprocess.Popen(command, env=around, start_new_session=True)
    try:
        until(lambda: path.exists() and path.read_text().count("\n") >= 5)
    finally:
        os.killpg(begun.pid, signal.SIGKILL)
        begun.wait()
    survived = Kept(path).rows
    assert 5 <= len(survived) < 40

    subprocess.run(command, env=around, check=True, timeout=60)

    lines = [json.loads(line) for line in path.read_text().splitlines() if line.endswith("}")]
    assert sorted(row["value"] for row in lines) == [*range(40)]  # none twice


def until(there, within_s=60.0):
    """Wait until something is there."""
    end = time.monotonic() + within_s
    while not there():
        assert time.monotonic() < end, "not there in time"
        time.sleep(0.05)


def test_nobody_at_the_address_is_said():
    pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    with pytest.raises(InputError, match="no Dask scheduler answers at tcp://127"):
        [*Workers(scheduler=address).results(drawn, PIECES)]


@contextmanager
def cluster(folder, workers=2):
    """The address of a scheduler on loopback with workers, as somebody would start them."""
    quiet = dict(stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder)
    around = imports_alike()
    file = folder / "scheduler.json"
    local = ["--host", "127.0.0.1", "--no-dashboard"]
    dask = [sys.executable, "-m", "dask"]
    started = [
        subprocess.Popen(
            [*dask, "scheduler", *local, "--port", "0", "--scheduler-file", str(file)],
            env=around,
            **quiet,
        )
    ]
    try:
        until(lambda: file.exists() and file.read_text().endswith("}"))
        address = json.loads(file.read_text())["address"]
        local += ["--local-directory", str(folder)]
        worker = [*dask, "worker", address, *local, "--nthreads", "1", "--no-nanny"]
        started += [subprocess.Popen(worker, env=around, **quiet) for _ in range(workers)]
        yield address
    finally:
        for each in reversed(started):  # a worker without its scheduler looks for it in vain
            each.kill()
            each.wait()


def test_a_cluster_gives_the_same_rows_and_keeps_them(tmp_path):
    pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    with cluster(tmp_path) as address:
        rows = Workers(scheduler=address).keep(Kept(tmp_path / "rows"), drawn, PIECES, silent)

    assert [row["value"] for row in rows] == [drawn(k)["value"] for k in PIECES.values()]
    assert set(Kept(tmp_path / "rows").rows) == set(PIECES)


@pytest.mark.slow
def test_a_check_on_a_cluster_answers_as_here(lq, tmp_path):
    pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    rig = tmp_path / "rig.toml"
    rig.write_text('plant = "servo_drive"\n')
    check = ("check", rig, lq, "--scenario", "step", "--runs", 4, "-q", "--json")
    with cluster(tmp_path) as address:
        there = call(*check, tmp_path / "there.json", "--scheduler", address)
    here = call(*check, tmp_path / "here.json", "--workers", 1)

    assert there.exit_code == here.exit_code
    found, again = (timeless(tmp_path / f"{name}.json") for name in ("there", "here"))
    assert len(found["runs"]) == 4
    assert found == again


def timeless(path):
    """The document of a check without what a clock measured."""
    document = json.loads(path.read_text())
    clock = ("solve_median_s", "solve_p99_s", "estimate_median_s")
    runs = [{k: v for k, v in run.items() if k not in clock} for run in document["runs"]]
    return {**document, "runs": runs}

"""Many pieces of work at once: processes of this machine, or of a Dask cluster.

Each piece has a key, and its result is a row of :class:`~studies.kept.Kept`: it is on disk as soon
as it is known.  A kill loses what was running, a second start does what is left.  Results depend on
the pieces alone and not on how many workers there were or in which order they were done.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

from studies.kept import Kept, Row
from workbench.errors import InputError, Message

Piece = TypeVar("Piece")
ANSWERS_WITHIN = "5s"


@dataclass(frozen=True)
class Workers:
    """Where pieces are worked on.

    Attributes
    ----------
    processes
        Of this machine, by default all cores that it may use; one works in this process.
    scheduler
        Address of a Dask scheduler, ``tcp://host:port``: then its workers do it instead.  It and
        they need the same version of this project, and see the same files.
    """

    processes: int = 0
    scheduler: str = ""

    @property
    def count(self) -> int:
        """Of processes, as many as this machine lets this one use where none are named."""
        from joblib import cpu_count

        return self.processes or cpu_count()

    def results(
        self, work: Callable[[Piece], Row], pieces: Mapping[str, Piece]
    ) -> Iterator[tuple[str, Row]]:
        """(key, row) of every piece, as they come; ``work`` and the pieces can be pickled.

        Raises
        ------
        InputError
            If nothing answers at the address of the scheduler, or Dask is not installed.
        """
        if self.scheduler:
            yield from _on_cluster(self.scheduler, work, pieces)
            return
        from joblib import Parallel, delayed, parallel_config

        count = self.count
        here = {"backend": "loky", "n_jobs": count, "inner_max_num_threads": 1}
        with parallel_config(**here if count > 1 else {"backend": "sequential"}):
            yield from Parallel(return_as="generator_unordered", batch_size=1)(
                delayed(_done)(work, key, piece) for key, piece in pieces.items()
            )

    def keep(
        self,
        kept: Kept,
        work: Callable[[Piece], Row],
        pieces: Mapping[str, Piece],
        say: Callable[[int, int], None],
    ) -> list[Row]:
        """The rows of all pieces in their order; only what is not kept yet is worked on.

        ``say`` is told how many are there, of how many.
        """
        left = {key: piece for key, piece in pieces.items() if key not in kept}
        done = len(pieces) - len(left)
        say(done, len(pieces))
        if left:
            for key, row in self.results(work, left):
                kept.add(key, row)
                done += 1
                say(done, len(pieces))
        return [kept.rows[key] for key in pieces]


_CHOSEN: ContextVar[Workers] = ContextVar("workers")


def chosen_workers() -> Workers:
    """Those of the innermost :func:`working_with`; by default all cores."""
    return _CHOSEN.get(Workers())


@contextmanager
def working_with(workers: Workers) -> Iterator[None]:
    """What runs inside spreads its pieces over these workers."""
    before = _CHOSEN.set(workers)
    try:
        yield
    finally:
        _CHOSEN.reset(before)


def _done(work: Callable[[Piece], Row], key: str, piece: Piece) -> tuple[str, Row]:
    return key, work(piece)


def _on_cluster(
    address: str, work: Callable[[Piece], Row], pieces: Mapping[str, Piece]
) -> Iterator[tuple[str, Row]]:
    """The workers of a Dask scheduler do it.

    Not by way of joblib, whose backend for Dask now and then waits for ever for its last result
    (joblib 1.6, distributed 2026.8; once in about ten times with eight quick pieces).
    """
    try:
        from distributed import Client, as_completed
    except ImportError as error:
        needed = "the extra `cluster`, dask[distributed]"
        raise InputError(Message("Dask is not installed", "--scheduler", needed)) from error
    try:
        client = Client(address, timeout=ANSWERS_WITHIN)
    except (OSError, ValueError) as error:
        what = f"no Dask scheduler answers at {address}"
        raise InputError(Message(what, "--scheduler", "tcp://host:port of one")) from error
    with client:
        doing = client.map(partial(_done, work), pieces.keys(), pieces.values(), pure=False)
        for _, found in as_completed(doing, with_results=True):
            yield found

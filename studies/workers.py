"""Many pieces of work at once: processes of this machine, or of a Dask cluster.

Each piece has a key, and its result is a row of :class:`~studies.kept.Kept`: it is on disk as soon
as it is known.  A kill loses what was running, a second start does what is left.  Results depend on
the pieces alone and not on how many workers there were or in which order they were done.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import TypeVar

from studies.kept import Kept, Row
from workbench.errors import InputError, Message

Piece = TypeVar("Piece")
ANSWERS_WITHIN = "5s"
WORKERS_WITHIN_S = 60  # of a cluster that has just been started


@dataclass(frozen=True)
class Workers:
    """Where pieces are worked on.

    Attributes
    ----------
    processes
        Of this machine, all its cores by default; one works in this process.
    scheduler
        Address of a Dask scheduler, ``tcp://host:port``: then its workers do it instead.  They need
        the same version of this project and see the same files.
    """

    processes: int = 0
    scheduler: str = ""

    def results(
        self, work: Callable[[Piece], Row], pieces: Mapping[str, Piece]
    ) -> Iterator[tuple[str, Row]]:
        """(key, row) of every piece, as they come; ``work`` and the pieces can be pickled.

        Raises
        ------
        InputError
            If nothing answers at the address of the scheduler, or Dask is not installed.
        """
        from joblib import Parallel, delayed

        with self._backend():
            yield from Parallel(return_as="generator_unordered")(
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

    def _backend(self) -> AbstractContextManager[object]:
        from joblib import parallel_config

        if self.scheduler:
            return _on_cluster(self.scheduler)
        count = self.processes or os.cpu_count() or 1
        if count == 1:
            return parallel_config(backend="sequential")
        return parallel_config(backend="loky", n_jobs=count, inner_max_num_threads=1)


def _done(work: Callable[[Piece], Row], key: str, piece: Piece) -> tuple[str, Row]:
    return key, work(piece)


@contextmanager
def _on_cluster(address: str) -> Iterator[None]:
    """Joblib's work goes to the workers of a Dask scheduler."""
    from joblib import parallel_config

    try:
        from distributed import Client
    except ImportError as error:
        needed = "the extra `cluster`, dask[distributed]"
        raise InputError(Message("Dask is not installed", "--scheduler", needed)) from error
    try:
        client = Client(address, timeout=ANSWERS_WITHIN)
    except (OSError, ValueError) as error:
        what = f"no Dask scheduler answers at {address}"
        raise InputError(Message(what, "--scheduler", "tcp://host:port of one")) from error
    patient = {"wait_for_workers_timeout": WORKERS_WITHIN_S}
    with client, parallel_config(backend="dask", client=client, **patient):
        yield

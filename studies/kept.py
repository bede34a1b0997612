"""Finished pieces of long work, kept on disk: a kill loses what runs, a second start goes on."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

Row = dict[str, Any]


class Kept:
    """Rows of a file of JSON lines, by key; a line that a kill cut short is left out."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows: dict[str, Row] = {}
        for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
            try:
                row = json.loads(line)
            except json.JSONDecodeError:
                continue
            self.rows[row["key"]] = row

    def __contains__(self, key: str) -> bool:
        return key in self.rows

    def add(self, key: str, row: Mapping[str, Any]) -> None:
        """Keep a row; it is on disk when this returns."""
        kept = {"key": key, **row}
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("ab+") as file:
            cut = False
            if file.tell():
                file.seek(-1, os.SEEK_END)
                cut = file.read() != b"\n"
            file.write(("\n" if cut else "").encode() + json.dumps(kept).encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())
        self.rows[key] = kept

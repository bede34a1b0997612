"""Writing a rig file that reads back to the same model, to the last bit."""

from __future__ import annotations

from pathlib import Path

from workbench.errors import InputError
from workbench.plant import Plant
from workbench.plant_files import as_it_came, plant_text
from workbench.recording_format import default_format, format_lines
from workbench.rig import ACCEPTED, Rig, parameter_names
from workbench.rig_laws import seen_lines, with_laws
from workbench.rig_text import RigText, quoted, read_text
from workbench.units import public_name, written
from workbench.whole_file import whole_file


def write_rig(rig: Rig, path: Path | str) -> None:
    """The rig as a TOML file: what differs from the plant's own, and what is known of it.

    Parameters with a standard deviation, such as fitted ones, and those that the rig's own file
    names are written with their value even where that is the plant's own.  The file appears only
    once it is complete.
    """
    with whole_file(path) as unfinished:
        unfinished.write_text(rig_text(rig, Path(path).parent), encoding="utf-8")


def rig_text(rig: Rig, folder: Path | None = None) -> str:
    """The text that :func:`write_rig` writes; a user's own plant as seen from ``folder``."""
    own = with_laws(as_it_came(rig.plant), rig.added)
    lines = [ACCEPTED + " ".join(note.split()) for note in rig.notes]
    lines += [""] if lines else []
    lines += [f"name = {quoted(rig.name)}", f"plant = {quoted(plant_text(rig.plant, folder))}"]
    if rig.removed or rig.added:
        lines += ["", "[effects]"]
        lines += [f"remove = {_list(rig.removed)}"] if rig.removed else []
        lines += [f"add = {_list(rig.added)}"] if rig.added else []
    lines += _section("values", {n: written(v, n) for n, v in _told(rig, own).items()})
    lines += _section("uncertainty", {n: written(v, n) for n, v in rig.deviations.items()})
    if rig.fixed:
        lines += ["", "[fixed]", f"names = {_list(sorted(map(public_name, rig.fixed)))}"]
    lines += seen_lines(rig.seen)
    if rig.reader != default_format(own):
        lines += ["", *format_lines(rig.reader, own)]
    return "\n".join(lines) + "\n"


def _told(rig: Rig, own: Plant) -> dict[str, float]:
    """Values that the file must hold, by full name, beside those of the plant as it came."""
    absent = {own.candidates[name].strength for name in rig.removed}
    kept = rig.deviations.keys() | _named(rig, own)
    return {
        name: value
        for name, value in rig.plant.values.items()
        if name not in absent and (value != own.values[name] or name in kept)
    }


def _named(rig: Rig, own: Plant) -> set[str]:
    """Full names of the values that the file which the rig was read from holds now.

    Whoever wrote one that is the plant's own means it to stay, should the plant's change.
    """
    if rig.path is None:
        return set()
    try:
        content, _ = read_text(rig.path)
        named = RigText(content, str(rig.path)).flat("values")
    except InputError:  # gone or changed since: only what it would keep is lost
        return set()
    names = parameter_names(own)
    return {full for key in named for full in names.get(key, ())}


def _section(title: str, entries: dict[str, str]) -> list[str]:
    if not entries:
        return []
    lines = (f"{quoted(public_name(name))} = {quoted(text)}" for name, text in entries.items())
    return ["", f"[{title}]", *lines]


def _list(names: tuple[str, ...] | list[str]) -> str:
    return "[" + ", ".join(map(quoted, names)) + "]"

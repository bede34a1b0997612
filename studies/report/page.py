"""Sections of text, tables and figures as one HTML file; the sections are kept beside it.

``report.json`` holds the sections, so that the page can be made again from the folder alone.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from workbench.errors import InputError, Message
from workbench.whole_file import whole_file

SECTIONS, PAGE, FIGURES = "report.json", "report.html", "figures"
ENDINGS = (".pdf", ".svg", ".csv")
SCHEMA = "workbench.report/1"
TEMPLATE = Path(__file__).with_name("page.html.j2")


@dataclass(frozen=True)
class Section:
    """One part of a report.

    text        paragraphs
    table       a table as a terminal shows it, or nothing
    figures     names of figures in the folder ``figures``, without ending
    """

    title: str
    text: tuple[str, ...] = ()
    table: str = ""
    figures: tuple[str, ...] = ()


def write_report(folder: Path, title: str, command: str, sections: Sequence[Section]) -> Path:
    """Keep the sections in the folder and write its page."""
    document = {
        "schema": SCHEMA,
        "title": title,
        "command": command,
        "sections": [asdict(section) for section in sections],
    }
    with whole_file(folder / SECTIONS) as unfinished:
        unfinished.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return render_folder(folder)


def render_folder(folder: Path) -> Path:
    """report.html of a folder: from its report.json, or else from all the figures it holds.

    Raises
    ------
    InputError
        If there is neither, the report.json is none of ours, or a figure is no SVG.
    """
    import jinja2

    title, command, sections = _read(folder)
    shown = [
        {**asdict(section), "drawn": [_drawn(folder, name) for name in section.figures]}
        for section in sections
    ]
    template = jinja2.Template(TEMPLATE.read_text(encoding="utf-8"), autoescape=True)
    page = template.render(title=title, command=command, sections=shown)
    with whole_file(folder / PAGE) as unfinished:
        unfinished.write_text(page, encoding="utf-8")
    return folder / PAGE


def _read(folder: Path) -> tuple[str, str, list[Section]]:
    path = folder / SECTIONS
    if path.is_file():
        try:
            document = json.loads(path.read_text(encoding="utf-8"))
            sections = [
                Section(s["title"], tuple(s["text"]), s["table"], tuple(s["figures"]))
                for s in document["sections"]
            ]
            return document["title"], document["command"], sections
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(Message("is no report of ours", file=str(path))) from error
    found = sorted({*folder.glob("*.svg"), *(folder / FIGURES).glob("*.svg")})
    if not found:
        expected = f"{SECTIONS} or figures (*.svg), as --figures and demo write them"
        raise InputError(Message("holds nothing to report", str(folder), expected))
    sections = [Section(svg.stem.replace("_", " "), figures=(svg.stem,)) for svg in found]
    return folder.resolve().name, "", sections


def _drawn(folder: Path, name: str) -> dict[str, str]:
    """The SVG of a figure, its files from the report's folder, and the command that made it."""
    places = (folder / FIGURES, folder)
    svg = next((p for p in (place / f"{name}.svg" for place in places) if p.is_file()), None)
    if svg is None:
        raise InputError(Message("there is no such figure", name, file=str(folder)))
    command = svg.with_suffix(".txt")
    said = command.read_text(encoding="utf-8").strip() if command.is_file() else ""
    beside = [p for p in map(svg.with_suffix, ENDINGS) if p.is_file()]
    files = ", ".join(path.relative_to(folder).as_posix() for path in beside)
    try:
        drawn = inline(svg.read_text(encoding="utf-8"), name)
    except ValueError as error:  # of bytes that are no text, too
        raise InputError(Message("is no SVG file", file=str(svg))) from error
    return {"svg": drawn, "files": files, "command": said}


def inline(svg: str, name: str) -> str:
    """The SVG element alone, with names of its own: a page holds several.

    Raises
    ------
    ValueError
        If there is no such element.
    """
    bare = re.sub(r"<metadata>.*?</metadata>", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    name = re.sub(r"[^\w-]", lambda odd: f"-{ord(odd[0]):x}-", name)  # no quote, no bracket
    own = re.sub(r'\bid="', f'id="{name}-', bare)
    own = re.sub(r'href="#', f'href="#{name}-', own)
    return re.sub(r"url\(#", f"url(#{name}-", own)

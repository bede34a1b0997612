"""Ceilings, docstrings, and nothing in a file that belongs to one machine only."""

import ast
import re
from urllib.parse import urlsplit

import pytest
from test_layers import ALLOWED, ROOT, files_of_the_project

LINES_OF_A_FILE = 300
LINES_OF_A_FUNCTION = 60
FOR_LATER = re.compile(r"\b(TOD[O]|FIXM[E])\b")
MACHINE_PATH = re.compile(r"(?<![\w.~-])/(?:work|root|home|Users|opt|mnt)/")
ADDRESS = re.compile(r"https?://[^\s\"'<>()`]*")
HOSTS = {
    "127.0.0.1": "the local page",
    "localhost": "the local page",
    "www.w3.org": "names of XML namespaces, never fetched",
    "doi.org": "sources",
    "keepachangelog.com": "the changelog's form",
}


@pytest.fixture(scope="module")
def texts():
    """Text of every text file of the project, by its path from the root."""
    found = {}
    for name in files_of_the_project():
        content = (ROOT / name).read_bytes()
        if b"\0" not in content[:8000]:
            found[name] = content.decode("utf-8", errors="replace")
    return found


@pytest.fixture(scope="module")
def modules(texts):
    """Syntax tree of every Python file, by its path from the root."""
    return {name: ast.parse(text) for name, text in texts.items() if name.endswith(".py")}


def lines_of_the_body(function):
    """Lines from the first statement after the docstring to the last."""
    body = function.body[1:] if ast.get_docstring(function) else function.body
    return body[-1].end_lineno - body[0].lineno + 1 if body else 0


def test_no_file_is_longer_than_one_can_read_at_once(texts):
    lengths = {name: len(text.splitlines()) for name, text in texts.items() if name.endswith(".py")}

    assert not {name: n for name, n in lengths.items() if n > LINES_OF_A_FILE}


def test_no_function_is_longer_than_a_screen(modules):
    functions = [
        (f"{name}:{node.lineno} {node.name}", lines_of_the_body(node))
        for name, tree in modules.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    ]

    assert not [(where, n) for where, n in functions if n > LINES_OF_A_FUNCTION]


def test_every_module_says_what_it_is(modules):
    assert not [name for name, tree in modules.items() if not ast.get_docstring(tree)]


def test_every_public_class_says_what_it_is(modules):
    silent = [
        f"{name}:{node.lineno} {node.name}"
        for name, tree in modules.items()
        if name.split("/")[0] in ALLOWED
        for node in tree.body
        if isinstance(node, ast.ClassDef)
        if not node.name.startswith("_") and not ast.get_docstring(node)
    ]

    assert not silent


@pytest.mark.parametrize("pattern", [FOR_LATER, MACHINE_PATH], ids=["for later", "machine path"])
def test_no_file_holds_notes_for_later_or_paths_of_one_machine(texts, pattern):
    found = [
        f"{name}:{number} {line.strip()[:80]}"
        for name, text in texts.items()
        for number, line in enumerate(text.splitlines(), start=1)
        if pattern.search(line)
    ]

    assert not found


def test_addresses_lead_only_to_known_hosts(texts):
    """A new source is one line in HOSTS; a package index never is."""
    found = [
        f"{name}: {address}"
        for name, text in texts.items()
        for address in ADDRESS.findall(text)
        if urlsplit(address).hostname not in HOSTS
    ]

    assert not found


@pytest.mark.parametrize(
    ("pattern", "text"),
    [
        (FOR_LATER, "# " + "TO" + "DO: later"),
        (MACHINE_PATH, 'open("' + "/ho" + 'me/someone/run.csv")'),
        (ADDRESS, "see " + "http" + "s://example.org/simple"),
    ],
)
def test_the_patterns_find_what_they_forbid(pattern, text):
    assert pattern.search(text)

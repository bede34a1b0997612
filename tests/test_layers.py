"""Imports go one way: workbench, linearize, then controllers and estimators, then studies."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import workbench

ROOT = Path(__file__).parent.parent
ALLOWED = {
    "workbench": {"workbench"},
    "linearize": {"linearize", "workbench"},
    "controllers": {"controllers", "linearize", "workbench"},
    "estimators": {"estimators", "linearize", "workbench"},
    "studies": {"studies", "controllers", "estimators", "linearize", "workbench"},
}
TOOL_FILES = {
    ".ci",
    ".gitignore",
    "CHANGELOG.md",
    "LICENSE",
    "Makefile",
    "README.md",
    "pyproject.toml",
    "compiler.lock",
    "requirements.lock",
}
SLOW_TO_IMPORT = {"bokeh", "control", "cvxpy", "filterpy", "matplotlib.pyplot"}


def imported(path: Path):
    """Full dotted names that a file imports anywhere, also inside its functions."""
    package = path.relative_to(ROOT).parent.parts
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            near = package[: len(package) + 1 - node.level] if node.level else ()
            module = ".".join([*near, *filter(None, [node.module])])
            yield from (f"{module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            yield from (a.value for a in node.args[:1] if isinstance(a, ast.Constant))


def files_of_the_project():
    """Paths known to git, and those it would take up, that exist; from the root, with slashes."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    try:
        listing = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    except (FileNotFoundError, subprocess.CalledProcessError):
        pytest.skip("not a git clone: no way to tell the project's files from others")
    return [name for name in listing.stdout.splitlines() if (ROOT / name).is_file()]


@pytest.mark.parametrize("folder", ALLOWED)
def test_a_folder_imports_only_what_lies_below_it(folder):
    paths = list((ROOT / folder).rglob("*.py"))

    assert paths, f"{folder} is empty"
    for path in paths:
        ours = {name.split(".")[0] for name in imported(path)} & ALLOWED.keys()
        assert ours <= ALLOWED[folder], f"{path.relative_to(ROOT)} imports {ours - ALLOWED[folder]}"


def test_the_verbs_are_functions_of_the_package_and_imported_when_asked_for():
    script = "import sys, workbench; print('casadi' in sys.modules); print(workbench.compare)"
    told = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True)

    assert told.stdout.split()[:3] == ["False", "<function", "compare"], told.stderr
    verbs = {"simulate", "compare", "diagnose", "add", "improve", "fit"}
    assert verbs <= {*workbench.__all__}
    for verb in workbench.__all__:
        assert getattr(workbench, verb).__name__ == verb
    with pytest.raises(AttributeError, match="no attribute 'compere'"):
        getattr(workbench, "compere")  # noqa: B009


def test_fitting_and_comparison_know_nothing_of_diagnosis():
    for below in ("fitting", "comparison"):
        for path in (ROOT / "workbench" / below).rglob("*.py"):
            above = [name for name in imported(path) if name.startswith("workbench.diagnosis")]

            assert not above, f"{path.relative_to(ROOT)} imports {above}"


def test_truth_stands_on_numpy_and_the_standard_library_alone():
    below = sys.stdlib_module_names | {"numpy"}
    for path in (ROOT / "studies" / "truth").rglob("*.py"):
        outside = {
            name
            for name in imported(path)
            if name.split(".")[0] not in below and not name.startswith("studies.truth.")
        }

        assert not outside, f"{path.relative_to(ROOT)} imports {outside}"


def test_the_top_level_holds_six_folders_the_readme_and_tool_files():
    top = {name.split("/")[0] for name in files_of_the_project()}

    assert top <= {*ALLOWED, "tests", *TOOL_FILES}


def test_the_command_starts_without_the_packages_that_are_slow_to_import():
    script = "import sys, studies.command_line; print(*sys.modules, sep='\\n')"

    loaded = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=60
    )

    assert loaded.returncode == 0, loaded.stderr
    assert not SLOW_TO_IMPORT & set(loaded.stdout.split())

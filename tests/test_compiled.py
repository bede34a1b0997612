"""Machine code gives what CasADi's virtual machine gives, and is never in the way."""

import logging
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec

import casadi as ca
import numpy as np
import pytest

from workbench import compiled as module
from workbench.compiled import compiled

PACKAGED = find_spec("ziglang") is not None
HAS_COMPILER = any(map(shutil.which, module.COMPILERS)) or PACKAGED
needs_compiler = pytest.mark.skipif(not HAS_COMPILER, reason="there is no C compiler here")


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache folder, and nothing remembered of compilers."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.delenv("WORKBENCH_NO_COMPILER", raising=False)
    remembered = (module._compiler, module._version, module._folder, module._machine)
    monkeypatch.setattr(module, "_refused", set())
    for function in remembered:
        function.cache_clear()
    yield tmp_path / "workbench" / "compiled"
    for function in remembered:
        function.cache_clear()


def small(name="small", scale=2.0):
    x = ca.MX.sym("x", 3)
    return ca.Function(name, [x], [scale * ca.sin(x)], ["x"], ["y"])


def machine_code(function):
    return function.class_name() == "External"


@needs_compiler
def test_the_compiled_step_is_equal_to_the_last_bit(drive):
    n, p = 300, drive.nominal[2]
    command = np.linspace(2.0, 8.0, n)[None]
    runs = [
        step.mapaccum(n)(drive.initial, command, np.zeros((0, n)), p).full()
        for step in (drive.model.step(1e-3), drive.model.compiled_step(1e-3))
    ]

    assert machine_code(drive.model.compiled_step(1e-3))
    np.testing.assert_array_equal(*runs)


@needs_compiler
def test_the_compiled_step_keeps_its_names(drive):
    step, fast = drive.model.step(1e-3), drive.model.compiled_step(1e-3)

    assert (fast.name_in(), fast.name_out()) == (step.name_in(), step.name_out())
    assert [fast.size_in(k) for k in range(4)] == [step.size_in(k) for k in range(4)]


@needs_compiler
def test_two_threads_do_not_disturb_each_other(drive):
    step, n, p = drive.model.compiled_step(1e-3), 64, drive.nominal[2]
    x = drive.initial[:, None] + np.zeros((1, n))
    u, d = np.linspace(0.0, 10.0, n)[None], np.zeros((0, n))
    alone, together = step.map(n), step.map(n, "thread", 2)
    expected = alone(x, u, d, p).full()
    with ThreadPoolExecutor(2) as pool:
        results = [*pool.map(lambda _: together(x, u, d, p).full(), range(20))]

    for result in results:
        np.testing.assert_array_equal(result, expected)


@needs_compiler
def test_a_library_is_compiled_once_and_found_again(cache):
    compiled(small())
    (library,) = cache.iterdir()
    made = library.stat().st_mtime_ns
    again = compiled(small())

    assert machine_code(again)
    assert [path.stat().st_mtime_ns for path in cache.iterdir()] == [made]


@needs_compiler
def test_functions_of_one_name_are_not_mixed_up(cache):
    twice, thrice = compiled(small(scale=2.0)), compiled(small(scale=3.0))

    np.testing.assert_allclose(thrice(1.0).full(), 1.5 * twice(1.0).full())


@needs_compiler
def test_processes_that_compile_the_same_at_once_all_get_it(cache):
    script = (
        "import casadi as ca; from workbench.compiled import compiled; x = ca.MX.sym('x');"
        "print(compiled(ca.Function('together', [x], [ca.cos(x)])).class_name())"
    )
    command = [sys.executable, "-c", script]
    processes = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(4)]

    assert [process.communicate()[0].strip() for process in processes] == ["External"] * 4
    assert len([*cache.iterdir()]) == 1


def test_without_a_compiler_one_line_says_so_and_the_function_serves_itself(
    cache, monkeypatch, caplog
):
    monkeypatch.setattr(module.shutil, "which", lambda command: None)
    function = small()
    with caplog.at_level(logging.INFO, logger="workbench"):
        results = [compiled(function) for _ in range(3)]

    assert results == [function] * 3
    assert len(caplog.records) == 1
    assert "no C compiler works here" in caplog.text


def test_the_compiler_can_be_forbidden(cache, monkeypatch):
    monkeypatch.setenv("WORKBENCH_NO_COMPILER", "1")

    assert not machine_code(compiled(small()))


@pytest.mark.skipif(not PACKAGED, reason="the package ziglang is not installed")
def test_the_compiler_of_a_package_serves_where_the_machine_has_none(cache, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    function = small()
    fast = compiled(function)

    assert machine_code(fast)
    np.testing.assert_array_equal(fast(0.3).full(), function(0.3).full())


def command(folder, name, lines):
    """A command of this name, first on the path of whoever prepends the folder."""
    path = folder / name
    path.write_text("#!/bin/sh\n" + lines)
    path.chmod(0o755)
    return path


needs_shell = pytest.mark.skipif(not shutil.which("sh"), reason="there is no shell here")


@needs_shell
def test_a_compiler_that_cannot_compile_costs_a_warning_and_nothing_else(
    cache, tmp_path, monkeypatch, caplog
):
    broken = 'case "$1" in --version) echo 1;; *) echo no room >&2; exit 1;; esac\n'
    monkeypatch.setenv("CC", str(command(tmp_path, "broken", broken)))
    function = small()

    assert compiled(function) is function
    assert "small is not compiled: no room" in caplog.text
    np.testing.assert_allclose(function(1.0).full(), 2.0 * np.sin(1.0))


@needs_shell
def test_a_compiler_that_only_says_how_to_get_one_is_none_and_that_is_said_once(
    cache, tmp_path, monkeypatch, caplog
):
    """As /usr/bin/cc on a Mac without its developer tools."""
    monkeypatch.setattr(module, "find_spec", lambda package: None)
    for name in module.COMPILERS:
        command(tmp_path, name, "echo install the tools >&2\nexit 1\n")
    monkeypatch.setenv("PATH", str(tmp_path))
    functions = [small(), small("other")]
    with caplog.at_level(logging.INFO, logger="workbench"):
        results = [compiled(function) for function in functions]

    assert results == functions
    assert [record.levelno for record in caplog.records] == [logging.INFO]


@needs_compiler
def test_a_damaged_library_is_compiled_once_more(cache, caplog):
    compiled(small())
    (library,) = cache.iterdir()
    library.unlink()  # the old one is still open
    library.write_bytes(b"no library")

    assert machine_code(compiled(small()))
    assert machine_code(compiled(small()))
    assert not caplog.records and library.stat().st_size > 100


def test_the_command_line_says_once_that_there_is_no_compiler(cache, monkeypatch, capsys):
    from studies.command_line.application import answering

    monkeypatch.setenv("WORKBENCH_NO_COMPILER", "1")
    with answering():
        compiled(small())
        compiled(small("other"))
    assert capsys.readouterr().err.count("WORKBENCH_NO_COMPILER is set") == 1

    module._compiler.cache_clear()
    with answering(quiet=True):
        compiled(small())
    assert capsys.readouterr().err == ""


@needs_compiler
def test_a_compiled_function_inside_another_is_refused_when_compiling_not_when_called(
    cache, caplog
):
    """Its C code would call a symbol that is not there."""
    x = ca.MX.sym("x", 3)
    outer = ca.Function("outer", [x], [compiled(small())(x) + 1.0])

    assert compiled(outer) is outer
    assert "outer is not compiled" in caplog.text


@needs_compiler
def test_a_folder_that_cannot_be_written_is_not_in_the_way(cache, monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))

    assert machine_code(compiled(small()))


@pytest.mark.parametrize("samples", [1, 19, 20, 21, 45])
def test_blocks_step_as_single_samples_do(drive, samples):
    model, (_, d, p) = drive.model, drive.nominal
    u = 4.95 + 2.0 * np.sin(np.linspace(0.0, 3.0, samples))[None]
    step, x = model.compiled_step(1e-3), drive.initial
    one_by_one = []
    for command in u.T:
        x = step(x, command, d, p).full().ravel()
        one_by_one.append(x)

    found = model.run(1e-3, samples)(drive.initial, u, np.zeros((0, samples)), p).full()

    np.testing.assert_array_equal(found, np.transpose(one_by_one))

"""What goes wrong, as a message and an exit code."""

import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest

from controllers.design_file import design
from studies.command_line.application import answering
from workbench.errors import UnknownNameError
from workbench.recording import Recording
from workbench.rig import default_rig


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (ArithmeticError("diverged"), 3),
        (ValueError("no"), 2),
        (UnknownNameError("no such effect"), 2),
        (KeyError("a bug's key"), 3),
        (KeyboardInterrupt(), 130),
        (StopIteration(), 3),
        (IndexError("list index out of range"), 3),
        (TypeError("argument of type 'int'\nis not iterable"), 3),
    ],
)
def test_what_goes_wrong_becomes_an_exit_code(error, code):
    import typer

    with pytest.raises(typer.Exit) as stopped, answering(quiet=True):
        raise error

    assert stopped.value.exit_code == code


@pytest.mark.parametrize(
    "wrong", [lambda: np.zeros(2) + np.zeros(3), lambda: np.full((2, 2), 1.0) @ np.zeros(3),
              lambda: int("seven"), lambda: plt.figure().add_subplot(1, 1, 7)],
)  # fmt: skip
def test_what_an_operation_or_a_library_refuses_is_no_wrong_input(wrong, capsys):
    """Shapes that do not fit were told as if the user had given them."""
    import typer

    with pytest.raises(typer.Exit) as stopped, answering(quiet=True):
        wrong()

    assert stopped.value.exit_code == 3
    assert capsys.readouterr().err.startswith("workbench: inside the program: ValueError")


def test_an_unknown_name_reads_as_its_message_and_is_a_key_error(capsys):
    import typer

    with pytest.raises(KeyError) as refused:
        design("lqq", default_rig("servo_drive").plant)
    with pytest.raises(typer.Exit), answering(quiet=True):
        raise refused.value

    (said,) = capsys.readouterr().err.splitlines()
    assert said.startswith("workbench: no controller lqq; there is pid, lq, mpc, ")
    assert said.endswith("; did you mean 'lq'?")


def test_a_channel_that_a_recording_lacks_is_wrong_input_with_the_nearest(capsys):
    import typer

    with pytest.raises(typer.Exit) as stopped, answering(quiet=True):
        Recording("run 7", 1e-3, {"slide.position_m": np.zeros(3)})["slide.positon_m"]

    assert stopped.value.exit_code == 2
    said = "run 7 has no slide.positon_m; it has slide.position_m; did you mean 'slide.position_m'?"
    assert capsys.readouterr().err == f"workbench: {said}\n"


def test_what_nobody_foresaw_is_one_line_and_its_trace_is_shown_when_asked(monkeypatch, capsys):
    import typer

    with pytest.raises(typer.Exit), answering():
        raise TypeError("argument of type 'int'\nis not iterable")
    assert capsys.readouterr().err.splitlines() == [
        "workbench: inside the program: TypeError argument of type 'int'; "
        "WORKBENCH_DEBUG=1 shows where"
    ]

    monkeypatch.setenv("WORKBENCH_DEBUG", "1")
    with pytest.raises(TypeError), answering():
        raise TypeError("argument")


def test_a_reader_that_has_enough_ends_a_command_without_a_word():
    """As behind ``| head``: what a shell calls SIGPIPE, and no wrong input."""
    words = [sys.executable, "-m", "studies.command_line", "effects"]
    command = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    command.stdout.close()

    assert command.stderr.read() == b""
    assert command.wait() == 141
    command.stderr.close()


def test_what_ends_a_command_politely_ends_it_as_an_interrupt_does():
    """``timeout`` ended a long ``improve`` with nothing to show for its finished rounds."""
    code = """
import os, signal, sys, time
import studies.command_line as line
from studies.command_line.application import answering

@line.app.command("wait")
def wait():
    with answering():
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(20.0)

sys.argv = ["workbench", "wait"]
line.main()
"""
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)

    assert answer.returncode == 130
    assert "stopped; no file is half-written" in answer.stderr

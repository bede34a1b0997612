"""Calling the command ``workbench`` from a test."""

from typer.testing import CliRunner

from studies.command_line import app


def call(*words):
    """What a command answers."""
    return CliRunner().invoke(app, [str(word) for word in words])

"""Recordings from files: CSV and MAT become channels in SI units on one uniform time grid."""

from workbench.reading.plausible import enough_samples
from workbench.reading.reader import read_recording
from workbench.reading.table import RecordingWarning
from workbench.reading.writer import write_recording

__all__ = ["RecordingWarning", "enough_samples", "read_recording", "write_recording"]

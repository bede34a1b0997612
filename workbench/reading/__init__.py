"""Recordings from files: CSV and MAT become channels in SI units on one uniform time grid."""

from workbench.reading.format import ChannelFormat, RecordingFormat, TimeFormat, default_format

__all__ = [
    "ChannelFormat",
    "RecordingFormat",
    "TimeFormat",
    "default_format",
]

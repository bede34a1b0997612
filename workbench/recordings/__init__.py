"""The real recordings: one loader for each data set, with its licence and what is known of it."""

from workbench.recordings.folder import real_data_folder

RECORDINGS = ("chamber_decay", "printed_cylinder", "vertical_cylinder")

__all__ = ["RECORDINGS", "real_data_folder"]

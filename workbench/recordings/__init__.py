"""The real recordings: one loader for each data set, with its licence and what is known of it.

A new data set is one file here and one name below; its ``everything(folder)`` gives each recording
with the rig it was made on.
"""

from workbench.recordings import chamber_decay, printed_cylinder, vertical_cylinder
from workbench.recordings.folder import real_data_folder

RECORDINGS = (chamber_decay, printed_cylinder, vertical_cylinder)

__all__ = ["RECORDINGS", "real_data_folder"]

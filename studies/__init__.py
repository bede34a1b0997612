"""Named, reproducible questions put to the workbench. Imports all; imported by nothing."""

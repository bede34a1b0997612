"""Independent truth simulators in plain numpy: they import nothing of ours.

A diagnosis tested on them is therefore not tested on its own model.
"""

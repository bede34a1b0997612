"""Another Python begun by a test."""

import os
import sys


def imports_alike():
    """Environment of a child that finds the modules which this process finds, tests too."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}

"""A plant against its recordings: error by signal, horizon and regime, and where it fails."""

from workbench.comparison.compare import compare

__all__ = ["compare"]

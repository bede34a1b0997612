"""What stands before an estimator shows it to those who ask: its plant, sample time and noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Wrapped:
    """Any estimator, ``inner``, behind something that changes what it is told."""

    inner: Any

    @property
    def sample_time_s(self) -> float:
        """That of the estimator."""
        return self.inner.sample_time_s

    @property
    def plant(self) -> Any:
        """The plant of the estimator."""
        return self.inner.plant

    @property
    def measurement_noise(self) -> Any:
        """That of the estimator."""
        return self.inner.measurement_noise

"""Whether a recording can be one of this rig: wrong units, exchanged columns, broken sensors."""

from workbench.consistency.check import checked, examined, trusted, warned
from workbench.consistency.common_channels import in_common
from workbench.consistency.findings import Finding, Weight

__all__ = ["Finding", "Weight", "checked", "examined", "in_common", "trusted", "warned"]

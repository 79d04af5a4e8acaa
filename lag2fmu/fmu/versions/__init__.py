"""The versions of FMI: for each a writer here and a gate in templates/engine."""

from collections.abc import Mapping

from lag2fmu.fmu.versions.fmi2 import FMI2
from lag2fmu.fmu.versions.fmi3 import FMI3
from lag2fmu.fmu.versions.version import Version

VERSIONS: Mapping[str, Version] = {version.name: version for version in (FMI2, FMI3)}
"""The versions by name, the default first."""

__all__ = ["FMI2", "FMI3", "VERSIONS", "Version"]

"""The option --set of an FMU, which is run as it is."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from lag2fmu.cli.settings import echo_settings
from lag2fmu.formats.loading import values_of
from lag2fmu.language.units import Unit
from lag2fmu.verify.instances import description_of
from lag2fmu.verify.plan import check_values
from lag2fmu.verify.scalars import scalars_of


def values_of_fmu(path: Path, texts: Mapping[str, str], units: Mapping[str, Unit]) -> dict[str, float]:
    """The values (SI) of ``texts`` for the FMU ``path``, shown on standard error; raises LoadError if it has none."""
    values = values_of(texts, units)
    if values:
        check_values(values, scalars_of(description_of(path), path))
        echo_settings(texts, units)
    return values

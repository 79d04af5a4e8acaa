"""Standard deviations as they stand on the command line: differences of values, in units."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from math import isfinite

import click

from lag2fmu.analysis.observing import assumed_noise
from lag2fmu.errors import LoadError
from lag2fmu.formats.loading import pairs_of
from lag2fmu.language.units import SECOND, Unit
from lag2fmu.mechanism.display import value_in_si
from lag2fmu.mechanism.record import Mechanism


def items_of(texts: Iterable[str]) -> Iterator[str]:
    """The items of all ``texts``, which have commas between."""
    return chain.from_iterable(text.split(",") for text in texts)


def size_of(name: str, text: str, units: Mapping[str, Unit]) -> float:
    """The SI value of ``text``, a difference of values of ``name``; the offset of its unit, as of degC, is left out.

    Raises LoadError for a text that is no finite number, and for a unit of another kind.
    """
    value = value_in_si(name, text, units)
    if not isfinite(value):
        raise LoadError(f"setting '{name}={text}': give a finite number")
    return value - value_in_si(name, f"0 {text.lstrip('+-.0123456789eE').strip()}", units)


def times_of(texts: Iterable[str]) -> dict[str, float]:
    """{name: time in s} of items NAME=TIME, with commas between; raises LoadError for what is no time."""
    return {name: size_of(name, text, {name: SECOND}) for name, text in pairs_of(items_of(texts)).items()}


def in_unit(size: float, unit: Unit | None) -> float:
    """A difference ``size`` (SI) in a ``unit``."""
    return size if unit is None else size / unit.factor


def noise_of(items: Iterable[str], mechanism: Mechanism, units: Mapping[str, Unit]) -> dict[str, float]:
    """{measured name: standard deviation, SI} of ``items`` NAME[=STD]; tells what is assumed where none is given.

    Raises LoadError for items of another form, and for variables of which nothing can be assumed.
    """
    names = [item.strip() for item in items]
    given = pairs_of(name for name in names if "=" in name)
    found: dict[str, float] = {}
    for item in names:
        name = item.partition("=")[0].strip()
        if name in found:
            raise LoadError(f"measure '{name}' is given twice; leave one out")
        if name in given:
            found[name] = size_of(name, given[name], units)
            continue
        found[name] = assumed_noise(mechanism, name)
        unit = units.get(name)
        shown = f"{in_unit(found[name], unit):g}{f' {unit.name}' if unit else ''}"
        told = f"standard deviation {shown}, a hundredth of its nominal value; give {name}=STD for another"
        click.echo(f"measure '{name}': {told}", err=True)
    return found

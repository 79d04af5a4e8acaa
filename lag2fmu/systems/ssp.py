"""``ssp``: FMUs and their connections as one archive, System Structure and Parameterization."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from math import isfinite
from pathlib import Path

from lag2fmu.archives import pack
from lag2fmu.errors import ExportError, LoadError
from lag2fmu.fmu.exported import Fmu, fmu_path
from lag2fmu.language.identifiers import suggestion
from lag2fmu.systems.components import Component, read_component
from lag2fmu.systems.connections import Components, End, connected
from lag2fmu.systems.controller import Controller, is_controller
from lag2fmu.systems.controllers import controller_component, controller_of, with_connectors
from lag2fmu.systems.joints import joined
from lag2fmu.systems.structure import PARAMETERS, SSD, VERSIONS, System, ssd, ssv

Source = Fmu | Controller | str | os.PathLike[str]
"""An exported FMU, the path of an FMU of any tool, a Controller, or a text FILE.py:NAME@SAMPLE_TIME."""


def ssp(
    fmus: Mapping[str, Source] | Iterable[Source],
    path: str | Path,
    *,
    connect: Iterable[str] = (),
    values: Mapping[str, float] | None = None,
    stop_time: float | None = None,
    version: str = VERSIONS[0],
    join: Iterable[str] = (),
) -> Path:
    """Write the system of ``fmus`` to ``path``, which ends in .ssp, and return it.

    - ``fmus``: {component: FMU}, or FMUs alone, whose components are then named after their files.
    - a component may be a Python function too, "FILE.py:NAME@SAMPLE_TIME", which lag2fmu alone runs.
    - ``connect``: words such as 'a.x:b.y0', an output and an input, or two terminals whose members match.
    - ``join``: words such as 'a.tip:b.base=revolute:z', two places that an ideal joint holds together; such a system
      runs by ``lag2fmu.simulate`` alone.
    - ``values`` {'a.m': value}: parameters and start values in the units of the FMU (SI units for those of lag2fmu),
      which become a parameter set.
    - ``stop_time`` (s): by default the longest of the FMUs.
    - ``version``: "1.0", or "2.0", which knows arrays and all types of FMI 3.0, and which fewer tools read.

    Raises LoadError for FMUs, connections and values that do not fit, ExportError for a ``path`` that cannot be
    written, and for what the version does not know.
    """
    target = Path(path)
    if target.suffix != ".ssp" or not target.parent.is_dir():
        raise ExportError(f"the system '{target}' has to be a file that ends in .ssp in a folder that exists")
    if version not in VERSIONS:
        raise ExportError(f"SSP {version!r} is not written here; {' and '.join(VERSIONS)} are")
    words = [*connect]
    components = with_connectors(words, read_components(fmus))
    sources: dict[Path, str] = {}
    for component in components.values():
        if component.controller is not None and component.controller.file is None:
            raise ExportError(
                f"the component '{component.name}' is a function of this process, which no file holds; "
                "give FILE.py:NAME@SAMPLE_TIME"
            )
        sources.setdefault(component.path, f"resources/{component.name}{component.path.suffix}")
    system = System(
        target.stem,
        components,
        {name: sources[component.path] for name, component in components.items()},
        connected(words, components),
        settings_of(values or {}, components),
        _stop_time(stop_time, components),
        version,
        joined(join, components),
    )
    files = {inside: file.read_bytes() for file, inside in sources.items()}
    pack({SSD: ssd(system), **files, **({PARAMETERS: ssv(system)} if system.values else {})}, target)
    return target


def read_components(fmus: Mapping[str, Source] | Iterable[Source]) -> Components:
    """The components of ``fmus``, see ``ssp``; raises LoadError for a name that is taken or a file that is no FMU."""
    found: dict[str, Component] = {}
    named = fmus.items() if isinstance(fmus, Mapping) else ((None, source) for source in fmus)
    for given, source in named:
        if isinstance(source, (Controller, str)) and is_controller(source):
            name = controller_of(source).label if given is None else given
            found[_free(name, str(source), found)] = controller_component(name, source)
            continue
        path = fmu_path(source)
        name = _free(path.stem if given is None else given, str(path), found)
        found[name] = read_component(name, path)
    if not found:
        raise LoadError("a system needs an FMU at least")
    return found


def _free(name: str, source: str, taken: Components) -> str:
    """``name``; raises LoadError if it cannot name the component ``source``, or is ``taken``."""
    if not name or "." in name:
        raise LoadError(
            f"'{source}': '{name}' cannot name a component; call it otherwise, e.g. arm={Path(source).name}"
        )
    if name in taken:
        raise LoadError(
            f"'{source}': there is a component '{name}' already, '{taken[name].path}'; "
            f"call one otherwise, e.g. {name}_2={source}"
        )
    return name


def settings_of(values: Mapping[str, float], components: Components) -> dict[End, float]:
    """{connector: value} for ``values`` {'a.m': value}; raises LoadError for a variable that cannot be set."""
    found: dict[End, float] = {}
    for word, value in values.items():
        end = End(*word.partition(".")[::2])
        if end.component not in components or not end.connector:
            raise LoadError(f"--set {word}: expected COMPONENT.VARIABLE; components are {', '.join(components)}")
        connectors = components[end.component].connectors
        free = [name for name, connector in connectors.items() if connector.settable]
        if end.connector not in free:
            why = "has no start value" if end.connector in connectors else "does not exist"
            raise LoadError(f"--set {word}: that variable {why}; {suggestion(end.connector, free)}")
        if connectors[end.connector].sizes:
            raise LoadError(f"--set {word}: that variable is an array; set its elements in the FMU when it is exported")
        if not isfinite(value):
            raise LoadError(f"--set {word}: {value} is not finite")
        low, high = connectors[end.connector].low, connectors[end.connector].high
        if value < low or value > high:
            raise LoadError(f"--set {word}: {value:g} is not within the bounds of that variable, [{low:g}, {high:g}]")
        found[end] = float(value)
    return found


def _stop_time(given: float | None, components: Components) -> float:
    if given is not None and not (isfinite(given) and given > 0):
        raise LoadError(f"--stop-time {given}: give a positive number of seconds")
    return float(given or max((c.stop_time or 0.0 for c in components.values()), default=0.0) or 1.0)

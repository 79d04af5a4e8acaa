"""The network of a system: as a file describes it, or of components that are given with their connections."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TypeAlias

from lag2fmu.errors import LoadError
from lag2fmu.fmu.exported import Model
from lag2fmu.fmu.exporting import as_fmu
from lag2fmu.systems.connections import connected
from lag2fmu.systems.controller import Controller, is_controller
from lag2fmu.systems.controllers import with_connectors
from lag2fmu.systems.joints import ends_of, joined
from lag2fmu.systems.network import Network, network_of_file
from lag2fmu.systems.ssp import read_components
from lag2fmu.systems.wires import Affine, Wire, conversion

Part: TypeAlias = "Model | Controller"
"""An FMU, a mechanism or what ``load`` takes, a Controller, or a text FILE.py:NAME@SAMPLE_TIME."""
Assembly: TypeAlias = "Path | Mapping[str, Part]"
"""The path of a system, or its components by name."""


@contextmanager
def network_of(system: Assembly, connect: Iterable[str] = (), join: Iterable[str] = ()) -> Iterator[Network]:
    """The network of a ``system``; its files exist as long as the context.

    ``connect`` and ``join`` are the connections and joints of {name: component}, see ``lag2fmu.ssp``. Mechanisms are
    exported. Raises LoadError for files, components, connections and joints that do not fit.
    """
    if isinstance(system, Path):
        if [*connect, *join]:
            raise LoadError(f"'{system}' has its connections inside; connect components that are given by name")
        with network_of_file(system) as network:
            yield network
        return
    with ExitStack() as opened:
        sources: dict[str, Path | Controller | str] = {
            name: part if is_controller(part) else opened.enter_context(as_fmu(part))  # type: ignore[arg-type]
            for name, part in system.items()
        }
        words = [*connect]
        components = with_connectors(words, read_components(sources))
        wires = []
        for source, target, factor in connected(words, components):
            units = (components[end.component].connectors[end.connector].unit for end in (source, target))
            converted = conversion(f"the connection of {source} with {target}", *units)
            wires.append(Wire(source, target, converted.after(Affine(factor))))
        joints = tuple(ends_of(joint, components, f"--join {joint}") for joint in joined(join, components))
        yield Network("the system", components, tuple(wires), {}, (), {}, 0.0, None, joints)

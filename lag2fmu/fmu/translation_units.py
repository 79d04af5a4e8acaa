"""C files joined to few translation units: starting a compiler for each of forty files costs more than compiling them.

Files are joined by inclusion, as they are: what one of them keeps to itself has a name that no other one has.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

MOST = 60_000
"""No file joins a unit with more characters, so that several units are compiled side by side."""


def translation_units(sources: Mapping[str, str]) -> dict[str, str]:
    """{file: text} to compile in place of the .c files in ``sources`` {file: text}; each includes some of them."""
    units: list[list[str]] = []
    for name in c_files(sources):
        room = (unit for unit in units if sum(len(sources[other]) for other in (*unit, name)) <= MOST)
        unit = next(room, None)
        if unit is None:
            units.append([name])
        else:
            unit.append(name)
    return {f"unit_{i}.c": including(unit) for i, unit in enumerate(units, start=1)}


def c_files(sources: Iterable[str]) -> list[str]:
    """The .c files among ``sources``, in the order of the alphabet."""
    return sorted(name for name in sources if name.endswith(".c"))


def including(files: Iterable[str]) -> str:
    """The text of a C file that includes ``files``."""
    return "".join(f'#include "{name}"\n' for name in files)

"""How much a MJCF file stands for: MuJoCo copies elements, in a time that grows with the square of their number, and
reads meshes of any size.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import prod
from pathlib import Path

from lag2fmu.errors import LoadError
from lag2fmu.formats.robots.meshes import check_mesh
from lag2fmu.xml_tree import XmlElement, parse

MOST_COPIES = 10_000
"""The most elements that are made by copying; MuJoCo takes 10 s for them, and 100 times that for 10 times more."""
_COPYING = ("replicate", "composite", "flexcomp")
_FILES = {"include", "model"}


def check_size(root: XmlElement, path: Path) -> None:
    """Check what is below ``root``, the root of the file ``path``, or in files that it names.

    Raises LoadError for more than MOST_COPIES copies of elements, and for a mesh that is too large to be read. A file
    that is missing or no XML is left to MuJoCo, which refuses it.
    """
    copies, elements = 0, []
    for element, times in _elements(root, path):
        elements.append(element)
        copies += times if element.tag in _COPYING[1:] or times > 1 else 0
        if copies > MOST_COPIES:
            raise LoadError(
                f"{path}: its <{'>, <'.join(_COPYING)}> make more than {MOST_COPIES} copies of elements; lower their "
                "count, because so large a mechanism is not read"
            )
    for file in _meshes(elements, path.parent):
        check_mesh(file)


def _elements(root: XmlElement, path: Path) -> Iterator[tuple[XmlElement, int]]:
    """All elements below ``root`` and in files that they name, and how often each of them is made."""
    seen, waiting = {path.resolve()}, [(root, 1)]
    while waiting:
        element, times = waiting.pop()
        times *= _count(element) if element.tag in _COPYING else 1
        yield element, times
        waiting += [(child, times) for child in element.children]
        waiting += [(child, times) for child in _included(element, path, seen)]


def _meshes(elements: Iterable[XmlElement], folder: Path) -> Iterator[Path]:
    """The files of meshes that the ``elements`` of a file in this ``folder`` name, and that are there."""
    found = list(elements)
    folders = {"", *(x.get("meshdir") or x.get("assetdir") for x in found if x.tag == "compiler")}
    names = {x.get("file") for x in found if x.tag == "mesh" and x.get("file")}
    yield from filter(Path.is_file, (folder / inner / name for inner in sorted(folders) for name in sorted(names)))


def _count(element: XmlElement) -> int:
    """How often an element copies, 1 where its count is no number, which MuJoCo refuses."""
    words = element.get("count", "1").split()
    return prod(int(word) for word in words) if words and all(word.isdecimal() for word in words) else 1


def _included(element: XmlElement, path: Path, seen: set[Path]) -> Iterator[XmlElement]:
    """The root of the file that ``element`` names, if it is there and was not ``seen``."""
    if element.tag not in _FILES or not element.get("file"):
        return
    file = (path.parent / element.get("file")).resolve()
    if file in seen or not file.is_file():
        return
    seen.add(file)
    try:
        yield parse(file.read_bytes(), str(file)).root
    except (LoadError, OSError):
        return

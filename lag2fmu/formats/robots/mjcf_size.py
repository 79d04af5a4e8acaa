"""How much a MJCF file stands for: MuJoCo copies elements, in a time that grows with the square of their number, and
reads meshes of any size.
"""

from __future__ import annotations

from collections.abc import Iterator
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
    copies, seen = 0, {path.resolve()}
    folders, meshes = {""}, set()
    waiting = [(root, 1)]
    while waiting:
        element, times = waiting.pop()
        copies += times if times > 1 else 0
        folders |= {element.get("meshdir") or element.get("assetdir")} if element.tag == "compiler" else set()
        meshes |= {element.get("file")} if element.tag == "mesh" and element.get("file") else set()
        if element.tag in _COPYING:
            times *= _count(element)
            copies += 0 if element.tag == "replicate" else times
        if copies > MOST_COPIES or times > MOST_COPIES:
            raise LoadError(
                f"{path}: its <{'>, <'.join(_COPYING)}> make more than {MOST_COPIES} copies of elements; lower their "
                "count, because so large a mechanism is not read"
            )
        waiting += [(child, times) for child in element.children]
        waiting += [(child, times) for child in _included(element, path, seen)]
    for file in (path.parent / folder / mesh for folder in folders for mesh in meshes):
        if file.is_file():
            check_mesh(file)


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

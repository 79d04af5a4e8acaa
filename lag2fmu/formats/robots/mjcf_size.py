"""How much a MJCF file stands for: MuJoCo copies elements, in a time that grows with the square of their number."""

from __future__ import annotations

from collections.abc import Iterator
from math import prod
from pathlib import Path

from lag2fmu.errors import LoadError
from lag2fmu.xml_tree import XmlElement, parse

MOST_COPIES = 10_000
"""The most elements that are made by copying; MuJoCo takes 10 s for them, and 100 times that for 10 times more."""
_COPYING = ("replicate", "composite", "flexcomp")
_FILES = {"include", "model"}


def check_copies(root: XmlElement, path: Path) -> None:
    """Raise LoadError if elements below ``root``, or in files that it names, are copied more than MOST_COPIES times.

    ``path`` is the file of ``root``. A file that is missing or no XML is left to MuJoCo, which refuses it.
    """
    copies, seen = 0, {path.resolve()}
    waiting = [(root, 1)]
    while waiting:
        element, times = waiting.pop()
        copies += times if times > 1 else 0
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

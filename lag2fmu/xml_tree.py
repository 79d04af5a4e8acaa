"""XML from unknown sources: elements with their lines. Document types are refused, so that no entity can expand."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from lag2fmu.errors import LoadError

MOST_ELEMENTS, LONGEST_TAG, _CHUNK = 1_000_000, 4 << 20, 1 << 20
"""The most elements of a document and bytes of one tag, beyond which it is refused; the bytes of a chunk."""


@dataclass(frozen=True, slots=True)
class XmlElement:
    """An element: its tag, its attributes, the line it begins in and its children (text is not kept)."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[XmlElement] = field(default_factory=list)

    def get(self, name: str, default: str = "") -> str:
        """The attribute ``name``, or ``default`` where it is absent."""
        return self.attributes.get(name, default)

    def child(self, tag: str) -> XmlElement | None:
        """The first child with ``tag``, if any."""
        return next((c for c in self.children if c.tag == tag), None)

    def all(self, *path: str) -> Iterator[XmlElement]:
        """The elements at the ``path`` of tags below this element, in the document's order."""
        tag, *rest = path
        for child in self.children:
            if child.tag == tag:
                yield from child.all(*rest) if rest else iter((child,))

    def walk(self) -> Iterator[XmlElement]:
        """The element itself and all elements below it, in the document's order."""
        waiting = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting.extend(reversed(element.children))


@dataclass(frozen=True)
class Document:
    """A root element and the encoding that the XML declaration states, '' if it states none."""

    root: XmlElement
    encoding: str


def parse(data: bytes, place: str, *, plain: bool = False) -> Document:
    """The XML in ``data``; ``place`` names it in errors. With ``plain``, tags have no prefix of their namespace.

    Raises LoadError if it is malformed, has a document type, or holds more than a description does.
    """
    root = XmlElement("", {}, 0)
    open_elements, encoding, count = [root], [""], 0
    parser = expat.ParserCreate()

    def begin(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > MOST_ELEMENTS:
            raise LoadError(f"'{place}' has more than {MOST_ELEMENTS} elements, which are not read")
        name = tag.rpartition(":")[2] if plain else tag
        element = XmlElement(name, attributes, parser.CurrentLineNumber)
        open_elements[-1].children.append(element)
        open_elements.append(element)

    def end(tag: str) -> None:
        open_elements.pop()

    def doctype(name: str, *_: object) -> None:
        raise LoadError(f"'{place}' has a document type ('<!DOCTYPE {name}'), which could define entities; remove it")

    def declaration(version: str, stated: str | None, standalone: int) -> None:
        encoding[0] = stated or ""

    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.StartDoctypeDeclHandler, parser.XmlDeclHandler = doctype, declaration
    try:
        for begun in range(0, len(data), _CHUNK):
            parser.Parse(data[begun : begun + _CHUNK], False)
            if begun - parser.CurrentByteIndex > LONGEST_TAG:
                raise LoadError(f"'{place}' has a tag of more than {LONGEST_TAG} bytes, which is not read")
        parser.Parse(b"", True)
    except (expat.ExpatError, LookupError, ValueError) as error:  # unknown encodings raise the last two
        raise LoadError(f"'{place}' is no well-formed XML: {error}") from error
    return Document(root.children[0], encoding[0])

"""XML elements as the bytes of a document."""

from __future__ import annotations

import xml.etree.ElementTree as ET


def document(root: ET.Element) -> bytes:
    """The document of ``root``: UTF-8, indented, with a declaration in double quotes."""
    ET.indent(root, "  ")
    body: bytes = ET.tostring(root, encoding="utf-8")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + body + b"\n"

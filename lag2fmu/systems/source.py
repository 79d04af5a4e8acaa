"""Where the files of a system lie: an archive .ssp, unpacked for the time of a run, or the folder of an .ssd."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote, urlsplit

from lag2fmu.archives import unpack
from lag2fmu.errors import LoadError
from lag2fmu.systems.structure import SSD
from lag2fmu.xml_tree import XmlElement, parse

SUFFIXES = (".ssp", ".ssd")


def is_system(model: object) -> bool:
    """Whether ``model`` is the path of a system: it ends in .ssp or .ssd."""
    return isinstance(model, (str, Path)) and Path(model).suffix in SUFFIXES


@dataclass(frozen=True)
class Source:
    """The description ``ssd`` of a system, and how it is called in messages.

    ``within``: the folder that its references must not leave, None for an .ssd that stands by itself.
    """

    ssd: Path
    label: str
    within: Path | None

    def file(self, reference: str) -> Path:
        """The file that ``reference``, a URI, names; it is relative to the .ssd.

        Raises LoadError if there is none, or if it lies outside of the archive.
        """
        parts = urlsplit(reference)
        if parts.scheme not in ("", "file") or parts.netloc not in ("", "localhost"):
            raise LoadError(f"{self.label}: '{reference}' is no file; give a relative path")
        path = (self.ssd.parent / unquote(parts.path)).resolve()
        if self.within is not None and not path.is_relative_to(self.within.resolve()):
            raise LoadError(f"{self.label}: '{reference}' leads out of the archive, and is not read")
        if not path.is_file():
            raise LoadError(f"{self.label}: there is no file '{reference}', which the system refers to")
        return path

    def xml(self, reference: str) -> XmlElement:
        """The root of the XML file that ``reference`` names, see ``root``. Raises LoadError as ``file``."""
        return parse(self.file(reference).read_bytes(), f"{self.label}:{reference}", plain=True).root

    def root(self) -> XmlElement:
        """The root of the description; raises LoadError for what is no XML.

        Its tags have no prefixes. Versions 1.0 and 2.0 of SSP share their namespaces, and no two of these have one name
        for different things.
        """
        return parse(self.ssd.read_bytes(), f"{self.label}:{self.ssd.name}", plain=True).root


@contextmanager
def source_of(path: Path) -> Iterator[Source]:
    """The system ``path``, an .ssp or .ssd; an archive is unpacked to a folder that is removed at the end.

    Raises LoadError for a file that is none, cannot be read, or has paths that lead out of it.
    """
    if not path.is_file():
        raise LoadError(f"'{path}': there is no such file")
    if path.suffix == ".ssd":
        yield Source(path, f"'{path}'", None)
        return
    with tempfile.TemporaryDirectory(prefix="lag2fmu-", ignore_cleanup_errors=True) as name:
        folder = Path(name)
        unpack(path, folder)
        if not (folder / SSD).is_file():
            raise LoadError(f"'{path}': there is no {SSD} in it; it is no system of SSP")
        yield Source(folder / SSD, f"'{path}'", folder)

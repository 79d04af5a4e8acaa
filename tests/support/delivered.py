"""The C code of an FMU: before it is joined, and as it stands in sources/."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from lag2fmu.fmu import Fmu
from lag2fmu.fmu.backends.native import NATIVE, describe
from lag2fmu.fmu.deriving import derived
from lag2fmu.fmu.sources import ALL, PREFIX_HEADER
from lag2fmu.fmu.versions import VERSIONS
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.mechanism import Mechanism

_SECTION = re.compile(r"^/\* ---- (\S+) \*/\n", re.MULTILINE)


@cache
def before_joining(
    model: str | Mechanism, fmi: str = "2.0", solver: str | None = None
) -> tuple[str, Mapping[str, str]]:
    """The identifier, and {file of the engine or for the mechanism: text}, without compiling."""
    version = VERSIONS[fmi]
    found = derived(as_mechanism(model), solver, NATIVE.solvers, events=version.has_ports)
    description, sources = describe(
        found.mechanism, found.equations, found.program, found.solver, found.vibrations, version
    )
    return description.model_identifier, sources


def unpack_sources(fmu: Fmu, folder: Path) -> Path:
    """The C file of the FMU that includes the others, beside them in ``folder``."""
    with zipfile.ZipFile(fmu.path) as archive:
        archive.extractall(folder, [name for name in archive.namelist() if name.startswith("sources/")])
    return folder / "sources" / ALL


def sections(folder: Path) -> dict[str, str]:
    """{file of the engine or for the mechanism: text} of unpacked sources, each behind all that it needs."""
    lines = (folder / ALL).read_text("utf-8").splitlines()
    files = [line.split('"')[1] for line in lines if line.startswith("#include")]
    text = "".join((folder / file).read_text("utf-8") for file in files if file != PREFIX_HEADER)
    _, *parts = _SECTION.split(text)
    return dict(zip(parts[::2], parts[1::2], strict=True))


def tables(folder: Path) -> str:
    """The headers in unpacked sources of an FMU of FMI 3.0 that declare its tables, in one."""
    declaring = ("variables.h", "mechanism.h", "event_sizes.h", "ports_size.h", "ports.h")
    return "".join(text for name, text in sections(folder).items() if name in declaring)


def file_with(folder: Path, section: str) -> tuple[Path, int, int]:
    """The file of unpacked sources with a ``section``, and where this begins and ends there."""
    for path in sorted(folder.glob("*.[ch]")):
        text = path.read_text("utf-8")
        marks = list(_SECTION.finditer(text))
        for mark, following in zip(marks, [*(m.start() for m in marks[1:]), len(text)], strict=False):
            if mark[1] == section:
                return path, mark.end(), following
    raise AssertionError(f"no file in {folder} has {section}")

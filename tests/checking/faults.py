"""FMUs with one fault each, made from a good one."""

from __future__ import annotations

import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from lag2fmu.fmu.materials import BILL_ENTRY

DESCRIPTION = "modelDescription.xml"
Fault = Callable[[ET.Element], None]


def files_of(path: Path, *, bill: bool = False) -> dict[str, bytes]:
    """The files in the archive ``path``; without its bill of materials, which tells of every change."""
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist() if bill or name != BILL_ENTRY}


def written(files: Mapping[str, bytes], path: Path) -> Path:
    """An archive of ``files`` at ``path``."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def spoiled(good: Path, path: Path, fault: Fault) -> Path:
    """A copy of ``good`` at ``path``, with ``fault`` done to the root of its modelDescription.xml."""
    files = files_of(good)
    root = ET.fromstring(files[DESCRIPTION])
    before = ET.tostring(root)
    fault(root)
    assert ET.tostring(root) != before, "nothing was changed"
    return written(files | {DESCRIPTION: ET.tostring(root, "UTF-8", xml_declaration=True)}, path)


def variable(root: ET.Element, name: str) -> ET.Element:
    """The ScalarVariable ``name``."""
    (found,) = (v for v in root.iter("ScalarVariable") if v.get("name") == name)
    return found


def index(root: ET.Element, name: str) -> str:
    """The index of the variable ``name``, from 1."""
    return str(1 + [v.get("name") for v in root.iter("ScalarVariable")].index(name))


def unknown(root: ET.Element, group: str, name: str) -> ET.Element:
    """The entry of the variable ``name`` in a list of ModelStructure."""
    (found,) = (u for u in root.find(f"ModelStructure/{group}") if u.get("index") == index(root, name))
    return found


def planted(rules: Mapping[str, str], every: int = 8) -> list[object]:
    """The parameters (fault, rule) of a test for ``rules`` {rule: its faults}: one in ``every`` belongs to each run."""
    faults = [(fault, rule) for rule, names in rules.items() for fault in names.split()]
    return [
        pytest.param(fault, rule, id=fault, marks=() if i % every == 0 else pytest.mark.slow)
        for i, (fault, rule) in enumerate(faults)
    ]

"""The archives of a release, its bill of materials and its hashes: files that depend on their content alone.

``python docs/site/release.py FOLDER NAME=SUBFOLDER...``: FOLDER holds a wheel and a sdist; for each name the archive
NAME.zip, the bill lag2fmu.cdx.json (CycloneDX 1.6), and SHA256SUMS of all are written there.
"""

from __future__ import annotations

import hashlib
import json
import sys
import zipfile
from email.message import Message
from email.parser import BytesParser
from pathlib import Path

from packaging.requirements import Requirement

from lag2fmu.archives import pack

SUMS, BILL = "SHA256SUMS", "lag2fmu.cdx.json"


def main(folder: Path, parts: dict[str, Path]) -> None:
    """Pack ``parts`` {name: folder} into ``folder``, and list the SHA-256 of each file there."""
    for name, part in parts.items():
        files = {path.relative_to(part).as_posix(): path.read_bytes() for path in part.rglob("*") if path.is_file()}
        pack(files, folder / f"{name}.zip")
    (folder / BILL).write_text(json.dumps(bill(folder), indent=1) + "\n", "utf-8", newline="\n")
    lines = [f"{sha256}  {name}\n" for name, sha256 in hashes(folder).items()]
    (folder / SUMS).write_text("".join(lines), "ascii", newline="\n")


def hashes(folder: Path) -> dict[str, str]:
    """{file: SHA-256} of the files in ``folder``, sorted, without that of hashes."""
    files = sorted(path for path in folder.iterdir() if path.is_file() and path.name != SUMS)
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def bill(folder: Path) -> dict[str, object]:
    """The bill of materials of the package whose wheel is in ``folder``: what it needs, and the hashes of its files.

    What is needed has no version, because an installation takes the newest that fits; the property tells what fits.
    """
    metadata = _metadata(next(folder.glob("*.whl")))
    files = [
        {"type": "file", "bom-ref": name, "name": name, "hashes": [{"alg": "SHA-256", "content": sha256}]}
        for name, sha256 in hashes(folder).items()
        if name != BILL
    ]
    needed = [_needed(Requirement(text)) for text in metadata.get_all("Requires-Dist", ())]
    package = {
        "type": "application",
        "bom-ref": "lag2fmu",
        "name": metadata["Name"],
        "version": metadata["Version"],
        "licenses": [{"license": {"id": metadata["License-Expression"]}}],
        "purl": f"pkg:pypi/{metadata['Name']}@{metadata['Version']}",
    }
    refs = [str(part["bom-ref"]) for part in needed if part["scope"] == "required"]
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": package},
        "components": [*needed, *files],
        "dependencies": [{"ref": "lag2fmu", "dependsOn": refs}],
    }


def _metadata(wheel: Path) -> Message:
    with zipfile.ZipFile(wheel) as archive:
        name = next(n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        return BytesParser().parsebytes(archive.read(name))


def _needed(requirement: Requirement) -> dict[str, object]:
    """The entry of a package that is needed, or of one of an extra, which is optional."""
    return {
        "type": "library",
        "bom-ref": str(requirement),
        "name": requirement.name,
        "scope": "optional" if "extra" in str(requirement.marker or "") else "required",
        "purl": f"pkg:pypi/{requirement.name.lower().replace('_', '-')}",
        "properties": [{"name": "org.lag2fmu:requirement", "value": str(requirement)}],
    }


if __name__ == "__main__":
    main(Path(sys.argv[1]), {name: Path(part) for name, _, part in (word.partition("=") for word in sys.argv[2:])})

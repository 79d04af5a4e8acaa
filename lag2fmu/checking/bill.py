"""The bill of materials in an FMU against its files: hashes that do not fit, files that are missing or not listed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from typing import Any

from lag2fmu.archives import read_text
from lag2fmu.checking.archive import Archive
from lag2fmu.checking.findings import Finding
from lag2fmu.errors import Lag2FmuError

SUFFIX = ".cdx.json"
"""How files with a bill of materials end (CycloneDX 1.6, recognised file patterns)."""
_RULE = "bill-of-materials"
_AGAIN = "export the FMU anew; whoever changed the file has to write the bill anew, too"
_HASHES = {"SHA-256": hashlib.sha256, "SHA-384": hashlib.sha384, "SHA-512": hashlib.sha512}


def bill_findings(archive: Archive) -> Iterator[Finding]:
    """The findings on each bill of materials below extra/: of the files that it lists, and those that it does not."""
    for bill in (name for name in archive.below("extra") if name.endswith(SUFFIX)):
        listed = _listed(archive, bill)
        if isinstance(listed, Finding):
            yield listed
            continue
        with archive.reading() as read:
            for name, hashes in listed.items():
                yield from _file_findings(archive, bill, name, hashes, read)
        for name in sorted(archive.files - {*listed, bill}) if listed else ():
            yield Finding(_RULE, name, f"'{bill}' does not list it", _AGAIN, "warning")


def _listed(archive: Archive, bill: str) -> dict[str, dict[str, str]] | Finding:
    """{file: {algorithm: hexadecimal hash}} of a bill, or what is wrong with the bill itself."""
    try:
        read: Any = json.loads(read_text(archive.path, bill))
        if not isinstance(read, dict) or read.get("bomFormat") != "CycloneDX":
            raise ValueError("its bomFormat is not CycloneDX")
        return {
            str(part["name"]): {str(h["alg"]): str(h["content"]) for h in part.get("hashes", ())}
            for part in read.get("components", ())
            if part["type"] == "file"
        }
    except (Lag2FmuError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        said = str(error) if isinstance(error, (Lag2FmuError, ValueError)) else "its components are of no known form"
        problem = f"is no bill of materials that can be read: {said}"
        return Finding(_RULE, bill, problem, "write it as CycloneDX in JSON")


def _file_findings(
    archive: Archive, bill: str, name: str, hashes: dict[str, str], read: Callable[[str], bytes]
) -> Iterator[Finding]:
    if name not in archive.files:
        yield Finding(_RULE, name, f"'{bill}' lists it, but the FMU does not hold it", _AGAIN)
        return
    known = [algorithm for algorithm in hashes if algorithm in _HASHES]
    if not known:
        yield Finding(_RULE, name, f"'{bill}' has no hash of it by {', '.join(_HASHES)}", _AGAIN, "warning")
    for algorithm in known:
        found = _HASHES[algorithm](read(name)).hexdigest()
        if found != hashes[algorithm].lower():
            problem = f"its {algorithm} is {found[:16]}..., '{bill}' says {hashes[algorithm][:16]}..."
            yield Finding(_RULE, name, problem, _AGAIN)

"""The bill of materials of an FMU: what it was made by, and the hash of each file in it.

Source: CycloneDX 1.6, JSON (ECMA-424). There is no serial number and no time, so equal FMUs have equal bills.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

from lag2fmu.archives import read_text
from lag2fmu.building.process import zig_version
from lag2fmu.errors import Lag2FmuError
from lag2fmu.fmu.compilers import FLAGS, MODULE_FLAGS, OF_WINDOWS
from lag2fmu.fmu.wasm.draft import FOLDER, NAME, commit
from lag2fmu.version import VERSION

BILL_ENTRY = "extra/org.lag2fmu/bom.cdx.json"
_SOLVER = "org.lag2fmu:solver"


def bill_of_materials(name: str, files: Mapping[str, bytes], *, solver: str, compiler: str | None) -> bytes:
    """The bill of the FMU of the mechanism ``name`` with these ``files``, {name in the archive: content}.

    ``solver``: its name; ``compiler``: 'zig' or 'host', None where nothing is compiled.
    """
    tools = [{"type": "application", "name": "lag2fmu", "version": VERSION}]
    told = [{"name": _SOLVER, "value": solver}]
    if compiler is not None:
        used = {"name": "ziglang", "version": zig_version()} if compiler == "zig" else {"name": "the host's C compiler"}
        tools.append({"type": "application", **used})
        told.append({"name": "org.lag2fmu:compiler-flags", "value": " ".join(FLAGS)})
    if compiler is not None and any(file.endswith(".dll") for file in files):
        told.append({"name": "org.lag2fmu:further-compiler-flags-of-windows", "value": " ".join(OF_WINDOWS)})
    portable = any(file.startswith(f"binaries/{FOLDER}/") for file in files)
    if portable:
        told.append({"name": "org.lag2fmu:compiler-flags-of-wasm", "value": " ".join(MODULE_FLAGS)})
    bill = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {
            "component": {"type": "library", "bom-ref": "fmu", "name": name},
            "tools": {"components": tools},
            "properties": told,
        },
        "components": [
            {
                "type": "file",
                "bom-ref": file,
                "name": file,
                "hashes": [{"alg": "SHA-256", "content": hashlib.sha256(files[file]).hexdigest()}],
            }
            for file in sorted(files)
        ]
        + (_of_component() if portable else []),
    }
    return (json.dumps(bill, indent=1) + "\n").encode()


def solver_inside(path: Path) -> str | None:
    """The name of the solver of the FMU ``path``; None where its bill does not tell."""
    try:
        bill = json.loads(read_text(path, BILL_ENTRY))
        told = {item["name"]: str(item["value"]) for item in bill["metadata"]["properties"]}
    except (Lag2FmuError, ValueError, LookupError, TypeError):  # of another tool or version
        return None
    return told.get(_SOLVER)


def _of_component() -> list[dict[str, object]]:
    """What is in a component for WebAssembly beside the FMU's own code: the C library, and the draft's interfaces."""
    source = {"type": "vcs", "url": "https://github.com/modelica/fmi-ls-wasm"}
    library = f"statically linked, as ziglang {zig_version()} has it"
    return [
        {"type": "library", "bom-ref": "wasi-libc", "name": "wasi-libc", "description": library},
        {"type": "data", "bom-ref": NAME, "name": NAME, "version": commit(), "externalReferences": [source]},
    ]

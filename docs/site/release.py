"""The archives of a release: folders as .zip files that depend on their content alone, and the hashes of all files.

``python docs/site/release.py FOLDER NAME=SUBFOLDER...``: for each the archive NAME.zip in FOLDER, and SHA256SUMS there.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

from lag2fmu.fmu.pack import pack


def main(folder: Path, parts: dict[str, Path]) -> None:
    """Pack ``parts`` {name: folder} into ``folder``, and list the SHA-256 of each file there."""
    for name, part in parts.items():
        files = {path.relative_to(part).as_posix(): path.read_bytes() for path in part.rglob("*") if path.is_file()}
        pack(files, folder / f"{name}.zip")
    sums = folder / "SHA256SUMS"
    released = sorted(path for path in folder.iterdir() if path.is_file() and path != sums)
    lines = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in released]
    sums.write_text("".join(lines), "ascii", newline="\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), {name: Path(part) for name, _, part in (word.partition("=") for word in sys.argv[2:])})

"""Libraries that are kept: with LAG2FMU_LIBRARIES naming a folder, the same sources are compiled once."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from uuid import uuid4

from lag2fmu.errors import BuildError

VARIABLE = "LAG2FMU_LIBRARIES"
"""The variable of the environment that names the folder; unset or empty, nothing is kept."""


def kept(made_of: Sequence[object], build: Callable[[], bytes]) -> bytes:
    """What ``build`` makes of ``made_of`` (everything that has a part in it), or made of the same before.

    A file's time is when it was used last. Raises BuildError where the folder cannot be used.
    """
    place = os.environ.get(VARIABLE)
    if not place:
        return build()
    file = Path(place, hashlib.sha256(repr(made_of).encode()).hexdigest())
    try:
        if file.is_file():
            os.utime(file)
            return file.read_bytes()
        library = build()
        file.parent.mkdir(parents=True, exist_ok=True)
        written = file.with_name(f"{file.name}-{uuid4().hex}")  # and moved: another process finds all of it or nothing
        written.write_bytes(library)
        written.replace(file)
    except OSError as error:
        raise BuildError(
            f"the folder '{place}' of {VARIABLE} cannot be used: {error.strerror or error}; name another one, or none"
        ) from error
    return library

"""Libraries that are kept: if LAG2FMU_LIBRARIES names a folder, the same sources are compiled only once."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from uuid import uuid4

from lag2fmu.errors import BuildError

VARIABLE = "LAG2FMU_LIBRARIES"
"""The environment variable that names the folder; if it is unset or empty, nothing is kept."""


def kept(made_of: Sequence[object], build: Callable[[], bytes]) -> bytes:
    """The result of ``build``, or the kept result of an earlier build with an equal ``made_of``.

    ``made_of`` has everything that the result depends on. The time of a kept file says when it was used last. Raises
    BuildError if the folder cannot be used.
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
        written = file.with_name(f"{file.name}-{uuid4().hex}")  # moved when complete: no process reads half a file
        written.write_bytes(library)
        written.replace(file)
    except OSError as error:
        raise BuildError(
            f"the folder '{place}' of {VARIABLE} cannot be used: {error.strerror or error}; name another one, or none"
        ) from error
    return library

"""Files that are written whole or not at all: the one place where a result takes the place of what stood there."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from uuid import uuid4


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """The name of a new file, with the ending of ``path``, that takes the place of ``path`` when the block ends well.

    Where ``path`` is a symbolic link the file that it leads to is replaced and the link stays. A device or pipe is
    given as it is. Raises OSError for a place that cannot be written; after any error the old file is as it was.
    """
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_file() and not target.is_dir():  # a folder fails when it is to be replaced
        yield target
        return
    new = target.with_name(f".lag2fmu-{uuid4().hex}{target.suffix}")
    try:
        yield new
        new.replace(target)
    finally:
        new.unlink(missing_ok=True)

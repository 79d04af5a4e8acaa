"""Libraries that are compiled once a run of the tests: what one of its processes has built, the others take."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from uuid import uuid4

from lag2fmu.fmu.compilers import FLAGS, Platform, Progress, compile_libraries


def compiled_once(folder: Path) -> Callable[..., list[bytes]]:
    """``compile_libraries`` that keeps in ``folder`` what zig made of the same sources for the same platforms.

    All is built that the host's compilers build (they depend on the environment) or that someone watches.
    """

    def compile_or_take(
        sources: Mapping[str, str],
        include: Path,
        name: str,
        platforms: Iterable[Platform],
        compiler: str = "zig",
        progress: Progress | None = None,
    ) -> list[bytes]:
        platforms = list(platforms)
        if compiler != "zig" or progress is not None:
            return compile_libraries(sources, include, name, platforms, compiler, progress)
        key = repr((sorted(sources.items()), str(include), name, platforms, FLAGS))
        kept = folder / hashlib.sha256(key.encode()).hexdigest()
        if not kept.exists():
            written = folder / uuid4().hex  # and moved into place: another process finds all of it or nothing
            written.write_bytes(pickle.dumps(compile_libraries(sources, include, name, platforms, compiler)))
            written.replace(kept)
        found: list[bytes] = pickle.loads(kept.read_bytes())
        return found

    return compile_or_take

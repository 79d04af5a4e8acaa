"""pytest rewrites the asserts of all tests before it imports them; processes beside each other share this work.

In a fresh checkout each process would rewrite every file, which takes as long as to import the rest.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from _pytest.assertion import rewrite


def rewrite_shared(config: pytest.Config, files: Sequence[Path]) -> None:
    """Rewrite the ``files`` that no process has rewritten since they changed, each process from a place of its own.

    What is left out here, pytest does itself when it imports a file. So nothing is lost where the functions that pytest
    keeps to itself have other names.
    """
    worker = os.environ.get("PYTEST_XDIST_WORKER", "")
    parts = ("assertstate_key", "PYC_TAIL", "get_cache_dir", "try_makedirs", "_rewrite_test", "_write_pyc")
    if not worker or sys.dont_write_bytecode or not all(hasattr(rewrite, part) for part in parts):
        return
    if (state := config.stash.get(rewrite.assertstate_key, None)) is None:  # asserts are left as they are
        return
    first = int(worker.removeprefix("gw")) * len(files) // int(os.environ["PYTEST_XDIST_WORKER_COUNT"])
    for file in (*files[first:], *files[:first]):
        folder = rewrite.get_cache_dir(file)
        kept = folder / f"{file.stem}{rewrite.PYC_TAIL}"
        if kept.exists() and kept.stat().st_mtime > file.stat().st_mtime:
            continue
        if rewrite.try_makedirs(folder):
            source, code = rewrite._rewrite_test(file, config)
            rewrite._write_pyc(state, code, source, kept)

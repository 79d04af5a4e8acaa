"""The work of the verb ``check``."""

from __future__ import annotations

import sys
from pathlib import Path

from lag2fmu.checking.check import check_fmu
from lag2fmu.cli.terminal import console
from lag2fmu.progress import progress_bar


def check_archive(fmu: Path, run: bool, time_limit: float, key: str | None) -> None:
    """Print every breach of the standard in ``fmu``; exit with 1 if there is one.

    ``time_limit`` (s) is what each trial of a run may take; ``key`` is that of who should have signed ``fmu``. Raises
    LoadError for no FMU, no limit or no key.
    """
    title = f"checking, {time_limit:g} s a trial at most" if run else "checking"
    with progress_bar(title, 1.0 if run else None) as progress:
        findings = check_fmu(fmu, run=run, time_limit=time_limit, key=key, progress=progress)
    console().print(findings.table())
    sys.exit(0 if findings.passed else 1)

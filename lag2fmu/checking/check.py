"""``check_fmu``: all rules, one after the other."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

from lag2fmu.checking.apart import findings_apart, is_large
from lag2fmu.checking.contents import findings_in, read_archive
from lag2fmu.checking.findings import Findings
from lag2fmu.checking.isolated_run import TIME_LIMIT, run_findings
from lag2fmu.checking.signature import signature_findings
from lag2fmu.errors import LoadError


def check_fmu(
    path: str | Path,
    *,
    run: bool = True,
    time_limit: float = TIME_LIMIT,
    key: str | None = None,
    progress: Callable[[float], None] | None = None,
) -> Findings:
    """Check the FMU ``path``, of any tool, by the rules of its version: all problems, with rule, place and remedy.

    With ``run`` its library is run in a process of its own, where each trial may take ``time_limit`` (s). After one
    that takes longer the others of its kind are left out: an FMU that loops takes the limit once for model exchange and
    once for co-simulation. This executes code of the FMU. With ``key``, a public key of minisign as text or file, the
    signature ``path``.minisig beside it has to fit, else nothing is run. ``progress`` is told the share of the trials
    that is done, 0 to 1. Nothing is written but a temporary folder, which is removed at the end. Raises LoadError if
    ``path`` is no FMU of FMI 2.0 or 3.0, is not safe to unpack, or is so large that reading it does not end in time,
    for a limit that is no positive number, and for what is no key. Source: FMI 2.0.5 and 3.0.2 specifications.
    """
    if not 0.0 < time_limit < math.inf:
        raise LoadError(f"a trial of an FMU cannot have a time limit of {time_limit:g} s; give a positive number")
    path = Path(path)
    in_signature, notes = signature_findings(path, key)
    findings, more = findings_apart(path) if is_large(path) else findings_in(path)
    findings, notes = [*in_signature, *findings], [*notes, *more]
    if in_signature:
        notes.append("not run, because its signature does not say who made it")
    elif run:
        archive, description, rules = read_archive(path)
        in_run, note = run_findings(archive, description, rules, time_limit, progress)
        findings += in_run
        notes.append(note)
    else:
        notes.append("not run, as asked")
    findings.sort(key=lambda f: f.severity)  # errors come first, otherwise the order stays
    return Findings(path, tuple(dict.fromkeys(findings)), tuple(notes))

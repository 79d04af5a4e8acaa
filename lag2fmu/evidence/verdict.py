"""The record ``Verdict``: what one tool of others said of an FMU."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Outcome = Literal["passed", "FAILED", "not run"]


@dataclass(frozen=True)
class Verdict:
    """What the ``tool`` in ``version`` said of an FMU as ``kind``: the interface that it used, or "static" for checks.

    ``detail`` says how far a run was from the reference, what a checker found, or why nothing was run.
    """

    tool: str
    version: str
    kind: str
    outcome: Outcome
    detail: str

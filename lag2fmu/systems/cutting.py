"""``cut``: a mechanism as a system of FMUs that ideal joints hold together, where it was one."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from lag2fmu.errors import MechanismError
from lag2fmu.fmu.exporting import export
from lag2fmu.mechanism.cutting import Link, cuts_of, in_pieces, opened, with_pins
from lag2fmu.mechanism.record import Mechanism, complete
from lag2fmu.reference import integrate
from lag2fmu.systems.ssp import ssp

_SOON = 1e-9
"""The time (s) over which the whole is integrated to have its motion at the start."""


def cut(mechanism: Mechanism, at: Iterable[str], path: str | Path, **choices: Any) -> tuple[Path, tuple[str, ...]]:
    """Cut ``mechanism`` at frames or coordinates ``at``, and write the system of its pieces to ``path``, an .ssp.

    ``choices`` are those of ``lag2fmu.export`` for each piece. Returns the path, and the names of the outputs that
    belong to no single piece and are left out. Raises MechanismError for a place that cannot be cut, and for what works
    across it; ExportError as ``export`` and ``ssp``.
    """
    whole = opened(mechanism)
    cuts = cuts_of(whole, at)
    if not cuts:
        raise MechanismError("nothing is cut; give --at with the name of a frame or of a coordinate")
    first = integrate(complete(with_pins(whole, cuts)), [0.0, _SOON]).trajectory
    pieces = in_pieces(whole, cuts, dict(zip(first.names, first.values[0].tolist(), strict=True)))
    with tempfile.TemporaryDirectory(prefix="lag2fmu-", ignore_cleanup_errors=True) as folder:
        fmus = {
            name: export(complete(description), Path(folder) / f"{name}.fmu", **choices)
            for name, description in pieces.descriptions.items()
        }
        written = ssp(
            fmus,
            path,
            join=map(_word, pieces.links),
            stop_time=mechanism.experiment.stop_time,
            version="1.0" if choices.get("fmi", "2.0") == "2.0" else "2.0",
        )
    return written, pieces.left_out


def _word(link: Link) -> str:
    """The joint of ``link`` as ``ssp`` reads it."""
    axis = ",".join(map(repr, link.cut.axis))
    numbers = "".join(f":{name}={getattr(link, name)!r}" for name in ("damping", "stiffness", "rest"))
    acts = link.damping or link.stiffness
    ends = f"{link.inner}.{link.cut.seat.name}:{link.outer}.{link.cut.pin.name}"
    return f"{ends}={link.cut.kind}:{axis}{numbers if acts else ''}"

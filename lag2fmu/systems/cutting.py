"""``cut``: a mechanism as a system of FMUs that ideal joints hold together, where it was one."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path

from lag2fmu.description.description import Description
from lag2fmu.errors import DerivationError, MechanismError
from lag2fmu.fmu.exported import Fmu
from lag2fmu.fmu.exporting import export
from lag2fmu.mechanism.cutting import CutJoint, CutMechanism, in_pieces
from lag2fmu.mechanism.opening import cuts_of, opened, with_probes
from lag2fmu.mechanism.record import Mechanism, complete
from lag2fmu.reference.direct_integration import integrate
from lag2fmu.systems.ssp import ssp

_SOON = 1e-9
"""The time (s) over which the whole is integrated, in a step or two, to have its motion at the start."""


def cut(
    mechanism: Mechanism, at: Iterable[str], path: str | Path, *, fmi: str = "2.0", solver: str | None = None
) -> CutMechanism:
    """Cut ``mechanism`` at frames or coordinates ``at``, and write the system of its pieces to ``path``, an .ssp.

    ``fmi`` and ``solver`` are those of the pieces, see ``lag2fmu.export``. Returns the pieces. Raises MechanismError
    for a place that cannot be cut, for what works across it, and for a piece that has no motion of its own; ExportError
    as ``export`` and ``ssp``.
    """
    whole = opened(mechanism)
    cuts = cuts_of(whole, at)
    if not cuts:
        raise MechanismError("nothing is cut; give --at with the name of a frame or of a coordinate")
    first = integrate(complete(with_probes(whole, cuts)), [0.0, _SOON], whole=1.0).trajectory
    pieces = in_pieces(whole, cuts, dict(zip(first.names, first.values[0].tolist(), strict=True)))
    with tempfile.TemporaryDirectory(prefix="lag2fmu-", ignore_cleanup_errors=True) as folder:
        fmus = {
            name: _exported(name, description, Path(folder), fmi, solver)
            for name, description in pieces.descriptions.items()
        }
        ssp(
            fmus,
            path,
            join=map(_word, pieces.joints),
            stop_time=mechanism.experiment.stop_time,
            version="1.0" if fmi == "2.0" else "2.0",
        )
    return pieces


def _exported(name: str, description: Description, folder: Path, fmi: str, solver: str | None) -> Fmu:
    """The piece ``name`` as an FMU in the ``folder``. Raises MechanismError if its forces do not tell how it moves."""
    try:
        return export(complete(description), folder / f"{name}.fmu", fmi=fmi, solver=solver)
    except DerivationError as error:
        raise MechanismError(
            f"the piece '{name}' does not move by itself: {error}; or cut where both sides of the joint have mass"
        ) from error


def _word(joint: CutJoint) -> str:
    """The joint of ``joint`` as ``ssp`` reads it."""
    axis = ",".join(map(repr, joint.axis))
    numbers = "".join(f":{name}={getattr(joint, name)!r}" for name in ("damping", "stiffness", "rest"))
    acts = joint.damping or joint.stiffness
    ends = ":".join(f"{piece}.{place}" for piece, place in joint.ends.items())
    return f"{ends}={joint.kind}:{axis}{numbers if acts else ''}"

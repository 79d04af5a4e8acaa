"""Reference trajectories in an FMU, with which its receiver can check it.

They have the form of the layered standard FMI-LS-REF 1.0.0-alpha.1 (extra/org.fmi-standard.fmi-ls-ref/), and of the
experiments format of the Modelica Association, MA-HS-Experiments, to which it refers.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Callable

import numpy as np

from lag2fmu.deadline import OutOfTimeError, within
from lag2fmu.description.names import velocity
from lag2fmu.dynamics.lagrange import with_derived
from lag2fmu.errors import SimulationError
from lag2fmu.fmu.xml_text import document
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.direct_integration import integrate
from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.plan import check_limit

_FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
_NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
_HEAD = {
    "name": "org.fmi-standard.fmi-ls-ref",
    "version": "1.0.0-alpha.1",
    "description": "Layered Standard providing information on related files included in an FMU.",
}
SHORT = "the direct integration came to t = {:.4g} s in its time; give a longer --limit for more\n"
"""What is told where ``reference_of`` does not come to the end."""
_EXPERIMENT, _RESULT = "validation.exp", "reference.csv"


def reference_of(
    mechanism: Mechanism, progress: Callable[[float], None] | None = None, limit: float = math.inf
) -> Reference:
    """The direct integration of the default experiment of ``mechanism``, at its communication points.

    All inputs keep their start values. ``progress`` is told the share that is done, 0 to 1. The reference ends where
    the CPU time of ``limit`` (s) is over. Raises LoadError for a limit that is no time, and SimulationError if the
    integration fails, or does not leave its start in time.
    """
    mechanism, experiment = with_derived(mechanism), mechanism.experiment
    count = max(1, round(experiment.stop_time / experiment.step))
    try:
        with within(check_limit(limit)):
            return integrate(mechanism, np.linspace(0.0, experiment.stop_time, count + 1), progress=progress)
    except OutOfTimeError:
        raise SimulationError(
            f"mechanism '{mechanism.name}': the direct integration did not leave its start in {limit:g} s of CPU time; "
            "give a longer --limit, or leave the reference out"
        ) from None


def shortened(mechanism: Mechanism, reference: Reference, sentence: str) -> str:
    """The ``sentence`` with the time (s) at which the ``reference`` ends before the experiment; "" if it does not."""
    reached = float(reference.trajectory.time[-1])
    return "" if reached >= mechanism.experiment.stop_time * (1 - 1e-9) else sentence.format(reached)


def reference_files(
    mechanism: Mechanism, reference: Reference | None = None, *, arrays: bool = False
) -> dict[str, bytes]:
    """{name in the archive: content} of the direct integration of ``mechanism``, its experiment, and remarks on it.

    ``reference`` is that of ``reference_of``, if it is known. ``arrays``: the FMU has arrays, to which the remarks
    refer. Raises SimulationError if the integration fails. Source: FMI-LS-REF 1.0.0-alpha.1 specification.
    """
    reference = reference_of(mechanism) if reference is None else reference
    mechanism = with_derived(mechanism)
    columns = [name for q in mechanism.coordinates for name in (q.name, velocity(q.name))]
    columns += [z.name for z in mechanism.states]
    trajectory = Trajectory.of(reference.trajectory.time, {name: reference.trajectory[name] for name in columns})
    files = {_RESULT: trajectory.to_csv().encode(), _EXPERIMENT: _experiment(mechanism)}
    return {f"{_FOLDER}/{name}": content for name, content in files.items()} | {
        f"{_FOLDER}/fmi-ls-manifest.xml": _manifest(),
        "documentation/fmi-ls-ref.txt": _remarks(mechanism, reference, arrays).encode(),
    }


def _experiment(mechanism: Mechanism) -> bytes:
    """The experiment: times, communication step, tolerance, expected results."""
    experiment = mechanism.experiment
    root = ET.Element("Experiments", {"name": f"Validation of {mechanism.name}"})
    attributes = {
        "name": "default",
        "description": "motion from the start values; all inputs keep their start values",
        "startTime": "0.0",
        "stopTime": repr(float(experiment.stop_time)),
        "tolerance": repr(float(experiment.tolerance)),
        "stepSize": repr(float(experiment.step)),
    }
    ET.SubElement(ET.SubElement(root, "Experiment", attributes), "References", {"source": _RESULT, "type": "text/csv"})
    return document(root)


def _manifest() -> bytes:
    """fmi-ls-manifest.xml: the role of each file."""
    ET.register_namespace("fmi-ls", _NAMESPACE)
    root = ET.Element("fmiReferences", {f"{{{_NAMESPACE}}}fmi-ls-{key}": value for key, value in _HEAD.items()})
    for kind, source, role, text in (
        (
            "application/x-ma-hs-experiments",
            _EXPERIMENT,
            "experiment/validation",
            "an experiment to check this FMU with",
        ),
        ("text/csv", _RESULT, "result", "its results by direct integration on an independent path"),
        ("application/toml", "../org.lag2fmu/mechanism.toml", "model", "the mechanism that this FMU was made of"),
    ):
        ET.SubElement(root, "Related", {"type": kind, "source": source, "role": role, "description": text})
    return document(root)


def _remarks(mechanism: Mechanism, reference: Reference, arrays: bool) -> str:
    """Remarks for the receiver: how the reference was made, and how exact it is."""
    worst, growth = reference.relative_error.max(), reference.amplification.max()
    return (
        f"{_FOLDER}/{_RESULT}: the motion of {mechanism.title} over {mechanism.experiment.stop_time:g} s.\n"
        f"Made by direct integration ({reference.method}, SciPy) of equations of motion that were obtained from the\n"
        "mechanism on another path than those in this FMU. All values are in SI units.\n"
        + shortened(mechanism, reference, "It ends at t = {:.4g} s, where the time for the integration was over.\n")
        + f"Estimated error of the reference, relative to the range of each variable: {worst:.1e}.\n"
        f"A disturbance of the start grows up to {growth:.1e} times within this time; so does the error of a solver.\n"
        "Compare with a tolerance that allows for it.\n"
        + (
            "The columns are elements of the arrays q and qd, whose descriptions name them in order.\n"
            if arrays
            else ""
        )
    )

"""The files of a record beside the FMU, in the form of the FMI project's former cross-check."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from lag2fmu.evidence.verdict import Verdict
from lag2fmu.fmu.exported import Fmu
from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.version import VERSION

MOST = 10
"""Variables in a reference, by the rules of the cross-check (FMI Cross-Check Rules 4.1, section 3)."""

README = "Readme.txt"
TOOLS, OVERVIEW = "tools.json", "README.md"
BEGINS = {TOOLS: '[\n    {\n        "name": "lag2fmu"', OVERVIEW: "# FMUs of lag2fmu"}
"""{file beside the records: how its text begins}, by which a later call knows it as its own."""


def record_files(fmu: Fmu, fmi: str, reference: Reference, verdicts: Sequence[Verdict]) -> dict[str, str]:
    """{file name: text} of the record of ``fmu``, by version ``fmi``, beside the FMU itself."""
    name, mechanism = fmu.mechanism.name, fmu.mechanism
    experiment, time = mechanism.experiment, reference.trajectory.time
    options = {
        "StartTime": 0.0,
        "StopTime": float(time[-1]),
        "StepSize": float(experiment.step),
        "RelTol": float(experiment.tolerance),
    }
    files = {
        f"{name}_ref.csv": _reference(fmu, reference).to_csv(),
        f"{name}_ref.opt": "".join(f"{key},{value!r}\n" for key, value in options.items()),
        README: _readme(fmu, fmi, reference, verdicts),
    }
    signals = {v.name: v.start for v in fmu.description.variables if v.causality == "input"}
    constants = {key: float(value) for key, value in signals.items() if isinstance(value, (int, float))}
    if constants:
        ends = np.array([0.0, float(time[-1])])
        inputs = Trajectory.of(ends, {key: np.full(2, value) for key, value in constants.items()})
        files[f"{name}_in.csv"] = inputs.to_csv()
    return files


def _reference(fmu: Fmu, reference: Reference) -> Trajectory:
    """The first outputs of ``fmu`` that the ``reference`` knows, at most MOST."""
    outputs = [v.name for v in fmu.description.variables if v.causality == "output"]
    known = [name for name in outputs if name in reference.trajectory] or list(reference.scales)
    chosen = known[:MOST]
    return Trajectory.of(reference.trajectory.time, {name: reference.trajectory[name] for name in chosen})


def _readme(fmu: Fmu, fmi: str, reference: Reference, verdicts: Sequence[Verdict]) -> str:
    name, mechanism = fmu.mechanism.name, fmu.mechanism
    rows = [f"- {v.tool} {v.version}, {v.kind}: {v.outcome}; {v.detail}" for v in verdicts]
    return "\n".join(
        [
            f"{name}.fmu: {mechanism.title}",
            "",
            f"Exported by lag2fmu {VERSION}, FMI {fmi}, solver "
            f"{fmu.description.solver}: co-simulation and model exchange.",
            f"{name}_ref.csv is no run of this FMU: it is a direct integration ({reference.method}, SciPy) of",
            "equations that were obtained from the energies on another path. Its estimated error, relative to the",
            f"range of each variable, is {reference.relative_error.max():.1e}. A disturbance of the start grows "
            f"{reference.amplification.max():.1e} times",
            "until the end, and so do errors of a solver. Values are in SI units, and inputs keep their start values.",
            "",
            f"Features of FMI that it uses: {', '.join(_features(fmu))}.",
            "",
            "What tools said:",
            "",
            *rows,
            "",
        ]
    )


def _features(fmu: Fmu) -> list[str]:
    """What an importer can be tried with: interfaces, inputs, parameters, state events, states that are saved."""
    description = fmu.description
    inputs = sum(v.causality == "input" for v in description.variables)
    tunable = sum(v.variability == "tunable" for v in description.variables)
    counted = (
        (inputs, "inputs"),
        (tunable, "tunable parameters"),
        (description.interface.event_indicators or 0, "event indicators"),
    )
    return [
        "co-simulation",
        "model exchange",
        *(f"{what} ({count})" for count, what in counted if count),
        "directional derivatives",
        "states that are saved and restored",
    ]


def tools_entry(platforms: Iterable[str]) -> str:
    """A list with the entry for the FMI project's list of tools, in the form of its tools.json.

    ``platforms`` are words of that list. Source: CONTRIBUTING.md of modelica/fmi-standard.org, "Updating the tools
    list".
    """
    entry = {
        "name": "lag2fmu",
        "license": "osi",
        "url": "",
        "vendor": "lag2fmu",
        "vendorURL": "",
        "examplesURL": "",
        "description": "Derives the equations of motion of a mechanism from its Lagrangian: coordinates, energies, "
        "forces, constraints and contacts in, an FMU out",
        "features": [],
        "platforms": list(platforms),
        "interfaces": ["CLI", "library"],
        "fmiVersions": ["2.0", "3.0"],
        "fmuExport": ["CS", "ME"],
        "fmuImport": ["CS", "ME"],
        "layeredStandards": ["REF", "WASM"],
    }
    return json.dumps([entry], indent=4) + "\n"


def overview(found: Mapping[str, Sequence[Verdict]]) -> str:
    """A table in Markdown: a row for each mechanism of ``found``, a column for each tool and interface."""
    columns = list(dict.fromkeys((v.tool, v.version, v.kind) for verdicts in found.values() for v in verdicts))
    heads = [f"{tool} {version}<br>{kind}" for tool, version, kind in columns]
    lines = [
        f"{BEGINS[OVERVIEW]} {VERSION} in tools that import FMI",
        "",
        "Each folder holds an FMU, reference values from an independent path, and what tools said, with numbers.",
        "",
        "| mechanism | " + " | ".join(heads) + " |",
        "|---" * (len(heads) + 1) + "|",
    ]
    for name, verdicts in found.items():
        outcomes = {(v.tool, v.version, v.kind): v.outcome for v in verdicts}
        lines.append(f"| [{name}]({name}/{README}) | " + " | ".join(outcomes.get(c, "") for c in columns) + " |")
    return "\n".join(lines) + "\n"

"""Mechanisms in pieces against the same in one piece: errors, gaps, order and repetitions of steps.

Run with `python -m benchmarks.cutting [--energy] [MODEL[:JOINT] ...]`: each bundled mechanism is cut at each of its
joints in turn, and runs for 2 s at steps of 1 ms, as one FMU and as a system of FMUs. For the order it runs at longer
steps too, each half of the one before; where their errors are those of the solvers, there is none. With `--energy` it
runs for 100 s at 5 ms, without dampers, and its energy is compared.
"""

from __future__ import annotations

import sys
import tempfile
import warnings
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import cast
from unittest.mock import patch

import numpy as np
from rich.console import Console
from rich.table import Table

from lag2fmu.errors import Lag2FmuError, MechanismError, SimulationError
from lag2fmu.fmu.exporting import export
from lag2fmu.formats.loading import load, with_settings
from lag2fmu.mechanism.cutting import in_pieces
from lag2fmu.mechanism.opening import cuts_of, opened, with_probes
from lag2fmu.mechanism.record import Mechanism, complete
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.resources import bundled
from lag2fmu.systems import joint_steps
from lag2fmu.systems.assembling import network_of
from lag2fmu.systems.coupling import ClosedJoints, SystemRun
from lag2fmu.systems.cutting import cut
from lag2fmu.systems.running import simulate_system
from lag2fmu.verify.run import Run
from lag2fmu.verify.simulate import simulate_fmu

STOP, STEP = 2.0, 1e-3
"""s"""
TOLERANCE = 1e-12
FLOOR = 1.2e-9
"""The least error that tells an order, in m, rad and so on: more than what the solvers' tolerance lets pass."""
FAST = {"andrews_squeezer": 0.03, "slider_crank": 0.2}
"""{mechanism that turns fast: time of its run (s)}"""
HALVED = (0.02, 0.01, 0.005, 0.0025)
"""The steps that tell the order (s), of mechanisms that turn fast a tenth."""
UNDIVIDED = 12
"""The most runs of a step that tells the order: where three do not close the joints it is not divided."""
LONG_STOP, LONG_STEP = 100.0, 5e-3
"""Those of the energy, in s."""
CONSERVATIVE = {
    "acrobot": {"b1": "0", "b2": "0"},
    "cart_pole": {"c": "0", "d": "0"},
    "furuta_pendulum": {"b1": "0", "b2": "0"},
    "slides_problem_5": {"F0": "0"},
    "two_armed_robot": {"d": "0", "left_c": "0", "right_c": "0"},
}
"""{mechanism: what makes it keep its energy}"""
DRIFT = 1e-6
"""How far the energy may go, beyond that of the whole, as a part of the greatest kinetic energy."""
BARS = {"error": 1e-6, "gap": 1e-10, "median": 2, "most": 3, "order": 2.0}
"""What a cut has to reach: error, gap (m, rad), runs of a step in the median and at most, order."""


@dataclass(frozen=True)
class Whole:
    """A mechanism in one piece: what can be cut and its names ``at``, and why other names cannot; its FMU.

    ``stop`` (s) is the time that it runs, ``halved`` are the steps (s) that tell the order.
    """

    mechanism: Mechanism
    stop: float
    halved: tuple[float, ...]
    at: tuple[str, ...]
    refused: dict[str, str]
    fmu: Path


@dataclass(frozen=True)
class Cutting:
    """A cut: its joints, the errors of what both have, and how steps were made; errors by ``halved`` steps (s).

    ``error`` is the largest one of a place, an angle or another output, ``speeds`` that of a speed.
    """

    at: str
    joints: str
    error: float
    speeds: float
    halved: dict[float, float]
    run: SystemRun

    @property
    def order(self) -> float | None:
        """The order by the two shortest steps whose errors are above those of the solvers; None without two."""
        told = [error for error in self.halved.values() if error > FLOOR][-2:]
        return float(np.log2(told[0] / told[1])) if len(told) == 2 else None


def whole_of(model: str, folder: Path, values: Mapping[str, str]) -> Whole:
    """The bundled ``model`` with these ``values``, and the places of all its pieces, as an FMU in ``folder``."""
    mechanism = with_settings(load(model), values)
    d = opened(mechanism)
    found, refused = {}, {}
    for name in [frame.name for frame in d.frames] or [q.name for q in d.coordinates]:
        try:
            (one,) = cuts_of(d, [name])
            in_pieces(d, [one], _Zeros())
            found[name] = one
        except MechanismError as error:
            refused[name] = str(error)
    fmu = folder / "whole.fmu"
    if found:
        unique = {cut.root: cut for cut in found.values()}
        export(complete(with_probes(d, [*unique.values()])), fmu)
    halved = tuple(step / 10 if model in FAST else step for step in HALVED)
    return Whole(mechanism, FAST.get(model, STOP), halved, tuple(found), refused, fmu)


class _Zeros(dict[str, float]):
    """Start values that do not matter."""

    def __missing__(self, name: str) -> float:
        return 0.0


def cutting(whole: Whole, at: str, folder: Path) -> Cutting:
    """The ``whole`` cut ``at`` one joint. Raises Lag2FmuError where it cannot be cut, or its pieces do not run."""
    path = folder / f"{at}.ssp"
    joints = cut(whole.mechanism, [at], path).joints
    halved = {}
    for step in whole.halved:
        with suppress(SimulationError), patch.object(joint_steps, "_RUNS", UNDIVIDED):
            *errors, run = _compared(whole, path, step)
            if run.coupling.shortest > 0.9 * step:  # steps may be too long to close the joints
                halved[step] = max(errors)
    error, speeds, run = _compared(whole, path, STEP)
    return Cutting(at, "+".join(joint.kind for joint in joints), error, speeds, halved, run)


def _compared(whole: Whole, path: Path, step: float) -> tuple[float, float, SystemRun]:
    """(the error of the system ``path`` at steps of ``step`` (s), that of its speeds, its run)."""
    asked = Run(whole.stop, step, TOLERANCE)
    run = _simulated(path, asked)
    return *_differences(run, simulate_fmu(whole.fmu, asked)), run


def _simulated(path: Path, run: Run) -> SystemRun:
    with network_of(path) as network:
        return simulate_system(network, run)


def drifts(whole: Whole, at: str, folder: Path) -> tuple[float, float]:
    """How far the energy goes, of the whole and cut ``at`` a joint, as parts of the greatest kinetic energy.

    Raises Lag2FmuError as ``cutting``, and where no piece tells an energy.
    """
    path, energies = folder / f"{at}.ssp", ("total_energy", "kinetic_energy")
    found = cut(whole.mechanism, [at], path)
    pieces = found.descriptions
    if any(joint.stiffness or joint.damping for joint in found.joints):
        raise SimulationError("no piece tells the energy of the spring or damper in the joint")
    once = simulate_fmu(whole.fmu, Run(LONG_STOP, LONG_STEP, TOLERANCE, outputs=energies))
    names = [f"{piece}.{energies[0]}" for piece in pieces]
    run = _simulated(path, Run(LONG_STOP, LONG_STEP, TOLERANCE, outputs=names))
    size = float(once[energies[1]].max())  # where nothing pulls, it has no range
    own, total = once[energies[0]], np.sum([run[name] for name in names], axis=0)
    return float(np.abs(own - own[0]).max()) / size, float(np.abs(total - total[0]).max()) / size


def _differences(run: Trajectory, expected: Trajectory) -> tuple[float, float]:
    """The largest differences of what both have: of places and the like, of speeds."""
    found = [0.0, 0.0]
    pairs = [(name, other) for name in run.names if (other := _twin(name)) in expected.names]
    if not pairs:
        raise ValueError(f"nothing of {run.names} is in {expected.names}")
    for name, other in pairs:
        speed = other.endswith("_dot") or "velocity" in other
        found[speed] = max(found[speed], float(np.abs(run[name] - expected[other]).max()))
    return found[0], found[1]


def _twin(name: str) -> str:
    """The name in the whole of a variable of a piece: the place of the piece is that of its probe."""
    return name.partition(".")[2].replace("_pin_", "_cut_")


def _energy_row(whole: Whole, at: str, folder: Path) -> list[str]:
    own, pieces = drifts(whole, at, folder)
    within = "yes" if pieces <= own + DRIFT else "no"
    return [f"{own:.1e}", f"{pieces:.1e}", within if own <= DRIFT else "not conservative"]


def _row(whole: Whole, at: str, folder: Path) -> list[str]:
    found = cutting(whole, at, folder)
    joints, order = cast("ClosedJoints", found.run.coupling.joints), found.order
    passes = (
        found.error <= BARS["error"]
        and joints.gap <= BARS["gap"]
        and joints.median <= BARS["median"]
        and joints.most <= BARS["most"]
        and (order is None or order >= BARS["order"])
    )
    return [
        *(found.joints, f"{found.error:.1e}", f"{found.speeds:.1e}", f"{joints.gap:.1e}"),
        "-" if order is None else f"{order:.1f}",
        f"{joints.median:g}, {joints.most}",
        "yes" if passes else "no",
    ]  # fmt: skip


TABLES = {
    False: (_row, ("joints", "error", "of speeds", "gap", "order", "runs: median, most", "within")),
    True: (_energy_row, ("drift of the whole", "of the pieces", "within")),
}
"""{whether of energies: (what makes a row, what it has)}"""


def _rows(words: list[str], *, energy: bool) -> Iterator[list[str]]:
    """A row for each joint of the models, or the one that is named, in ``words``."""
    make, headings = TABLES[energy]
    for word in words:
        model, _, only = word.partition(":")
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            whole = whole_of(model, folder, CONSERVATIVE.get(model, {}) if energy else {})
            for at in [only] if only else whole.at:
                try:
                    row = [model, at, *make(whole, at, folder)]
                except Lag2FmuError as error:
                    row = [model, at, *"-" * (len(headings) - 1), f"no: {error}"]
                print(*row, sep="\t", flush=True)
                yield row
            for at, why in () if only else whole.refused.items():
                print(model, at, why, sep="\t", flush=True)


def main() -> None:
    """Print the table."""
    warnings.simplefilter("ignore")
    energy = "--energy" in sys.argv
    stop, step = (LONG_STOP, LONG_STEP) if energy else (STOP, STEP)
    table = Table(title=f"cut mechanisms over {stop:g} s, steps of {step * 1e3:g} ms, tolerance {TOLERANCE:g}")
    for heading in ("mechanism", "cut at", *TABLES[energy][1]):
        table.add_column(heading)
    for row in _rows([word for word in sys.argv[1:] if word != "--energy"] or [*bundled()], energy=energy):
        table.add_row(*row)
    Console(width=160).print(table)


if __name__ == "__main__":
    main()

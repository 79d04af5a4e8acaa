"""Mechanisms in pieces against the same in one piece: errors, gaps, order and repetitions of steps.

Run with `python -m benchmarks.cutting [MODEL ...]`: each bundled mechanism is cut at each of its joints in turn, and
runs for 2 s at steps of 1 ms, as one FMU and as a system of FMUs. For the order it runs at 4 and 2 ms too; where the
error of 2 ms is that of the solvers, there is none.
"""

from __future__ import annotations

import sys
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from lag2fmu.errors import Lag2FmuError, MechanismError, SimulationError
from lag2fmu.fmu.exporting import export
from lag2fmu.formats.loading import load
from lag2fmu.mechanism.cutting import in_pieces
from lag2fmu.mechanism.opening import cuts_of, opened, with_probes
from lag2fmu.mechanism.record import Mechanism, complete
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.resources import bundled
from lag2fmu.systems.assembling import network_of
from lag2fmu.systems.coupling import SystemRun
from lag2fmu.systems.cutting import cut
from lag2fmu.systems.running import simulate_system
from lag2fmu.verify.run import Run
from lag2fmu.verify.simulate import simulate_fmu

STOP, STEP = 2.0, 1e-3
"""s"""
TOLERANCE = 1e-12
FLOOR = 1e-10
"""The least error that tells an order, in m, rad and so on."""
LONGER = (10, 5)
"""The steps that tell the order, in STEP."""
BARS = {"error": 1e-6, "gap": 1e-10, "median": 2, "most": 3, "order": 2.0}
"""What a cut has to reach: error, gap (m, rad), runs of a step in the median and at most, order."""


@dataclass(frozen=True)
class Whole:
    """A mechanism in one piece: what can be cut and its names ``at``, and why other names cannot; its FMU."""

    mechanism: Mechanism
    at: tuple[str, ...]
    refused: dict[str, str]
    fmu: Path


@dataclass(frozen=True)
class Cutting:
    """A cut: its joints, the ``error`` of what both have, its errors at longer steps, and how the steps were made."""

    at: str
    joints: str
    error: float
    longer: tuple[float, ...]
    run: SystemRun

    @property
    def order(self) -> float | None:
        """The order by the errors at longer steps; None where they do not tell it."""
        if len(self.longer) < len(LONGER) or self.longer[1] < max(30 * self.error, FLOOR):
            return None
        return float(np.log2(self.longer[0] / self.longer[1]))


def whole_of(model: str, folder: Path) -> Whole:
    """The bundled ``model`` with the places of all its pieces, as an FMU in ``folder``."""
    mechanism = load(model)
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
    return Whole(mechanism, tuple(found), refused, fmu)


class _Zeros(dict[str, float]):
    """Start values that do not matter."""

    def __missing__(self, name: str) -> float:
        return 0.0


def cutting(whole: Whole, at: str, folder: Path) -> Cutting:
    """The ``whole`` cut ``at`` one joint. Raises Lag2FmuError where it cannot be cut, or its pieces do not run."""
    path = folder / f"{at}.ssp"
    joints = cut(whole.mechanism, [at], path).joints
    expected = simulate_fmu(whole.fmu, Run(STOP, STEP, TOLERANCE))
    longer = []
    with suppress(SimulationError):  # steps may be too long to close the joints
        longer = [_difference(_simulated(path, n * STEP), expected, n) for n in LONGER]
    run = _simulated(path, STEP)
    kinds = "+".join(joint.kind for joint in joints)
    return Cutting(at, kinds, _difference(run, expected, 1), tuple(longer), run)


def _simulated(path: Path, step: float) -> SystemRun:
    with network_of(path) as network:
        return simulate_system(network, Run(STOP, step, TOLERANCE))


def _difference(run: Trajectory, expected: Trajectory, every: int) -> float:
    """The largest difference of what both have; ``expected`` has so many times as many points."""
    pairs = [(name, other) for name in run.names if (other := _twin(name)) in expected.names]
    if not pairs:
        raise ValueError(f"nothing of {run.names} is in {expected.names}")
    return max(float(np.abs(run[name] - expected[other][::every]).max()) for name, other in pairs)


def _twin(name: str) -> str:
    """The name in the whole of a variable of a piece: the place of the piece is that of its probe."""
    return name.partition(".")[2].replace("_pin_", "_cut_")


def _row(model: str, found: Cutting) -> list[str]:
    joints, order = found.run.coupling.joints, found.order
    passes = (
        found.error <= BARS["error"]
        and joints.gap <= BARS["gap"]
        and joints.median <= BARS["median"]
        and joints.most <= BARS["most"]
        and (order is None or order >= BARS["order"])
    )
    return [
        *(model, found.at, found.joints, f"{found.error:.1e}", f"{joints.gap:.1e}"),
        "-" if order is None else f"{order:.1f}",
        f"{joints.median:g}, {joints.most}",
        "yes" if passes else "no",
    ]  # fmt: skip


def _rows(models: list[str]) -> Iterator[list[str]]:
    for model in models:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            whole = whole_of(model, folder)
            for at in whole.at:
                try:
                    row = _row(model, cutting(whole, at, folder))
                except Lag2FmuError as error:
                    row = [model, at, "", *"----", f"no: {error}"]
                print(*row, sep="\t", flush=True)
                yield row
            for at, why in whole.refused.items():
                print(model, at, why, sep="\t", flush=True)


def main() -> None:
    """Print the table."""
    warnings.simplefilter("ignore")
    table = Table(title=f"cut mechanisms over {STOP:g} s, steps of {STEP * 1e3:g} ms, tolerance {TOLERANCE:g}")
    for heading in ("mechanism", "cut at", "joints", "error", "gap", "order", "runs: median, most", "within"):
        table.add_column(heading)
    for row in _rows(sys.argv[1:] or [*bundled()]):
        table.add_row(*row)
    Console(width=160).print(table)


if __name__ == "__main__":
    main()

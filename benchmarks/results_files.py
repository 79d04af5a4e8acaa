"""results.txt of the problems whose description says what is in it, as IFToMM's library takes them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.library import Result
from benchmarks.stranger import Asked
from lag2fmu.reference.trajectory import Trajectory

Floats = NDArray[np.float64]
Columns = Callable[[Trajectory], list[Floats]]

COLUMNS: dict[str, tuple[str, Columns]] = {
    "light_cart_pole": (
        "Time X THETA XDOT THETADOT ENERGY",
        lambda t: (
            [t[name] for name in ("x", "theta", "x_dot", "theta_dot")] + [t["total_energy"] - t["total_energy"][0]]
        ),
    ),
    "spatial_slider_crank": ("Time X THETA", lambda t: [t["s"], t["theta"]]),
    "planar_simple_pendulum": ("Time X Y", lambda t: [t["x"], t["y"]]),
    "double_four_bar": ("Time X Y", lambda t: [t["x_B0"], t["y_B0"]]),
    "bricard": ("Time X Y Z", lambda t: [t["P3_x"], t["P3_y"], t["P3_z"]]),
    "flyball_governor": ("Time S", lambda t: [t["s"]]),
}
"""Problem -> its header and its columns after the time, in SI."""


def written(name: str, found: Mapping[Asked, Result], folder: Path) -> Path | None:
    """Write results.txt of the first run that meets all bars; None where the problem has no such file."""
    if name not in COLUMNS:
        return None
    met = [result for result in found.values() if all(number.met for number in result.numbers)]
    trajectory = (met or list(found.values()))[0].trajectory
    if trajectory is None:
        return None
    header, columns = COLUMNS[name]
    place = folder / name
    place.mkdir(parents=True, exist_ok=True)
    rows = np.column_stack([trajectory.time, *columns(trajectory)])
    titles = "".join(f"{title:>24}" for title in header.split())
    body = ["".join(f"{x:24.15E}" for x in row) for row in rows]
    (place / "results.txt").write_text("\n".join([titles, *body]) + "\n", "ascii", newline="\n")
    return place / "results.txt"

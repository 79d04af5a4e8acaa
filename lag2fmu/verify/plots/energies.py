"""The energies of a run over time, and whether the one that should stay does."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from lag2fmu.analysis.conserved import conserved
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.graph.batches import evaluate
from lag2fmu.verify.plots.figures import LINE, dressed, legend

Floats = NDArray[np.float64]

ENERGIES = {"kinetic_energy": "T", "potential_energy": "V", "total_energy": "T + V"}
H = "generalized_energy"


def energies_of(equations: EquationsOfMotion, values: Mapping[str, Floats | float]) -> dict[str, Floats]:
    """{energy: (times,) in J} of those that the mechanism has, at ``values`` {name: (times,) or number} in SI units."""
    found = {name: equations.energies[name] for name in (*ENERGIES, H) if name in equations.energies}
    numbers = evaluate(equations.graph, list(found.values()), values)
    return dict(zip(found, numbers, strict=True))


def draw_energies(axes: Axes, time: Floats, energies: Mapping[str, Floats]) -> None:
    """T, V and their sum over ``time`` (times,) in s."""
    for name, label in ENERGIES.items():
        if name in energies:
            axes.plot(time, energies[name], label=label, **LINE)
    dressed(axes, "energies", vertical="in J")
    legend(axes)


def is_kept(equations: EquationsOfMotion, values: Mapping[str, Floats | float]) -> bool:
    """Whether h stays along a run: it is conserved, and the forces from outside, of ``values``, are zero throughout."""
    g, v = equations.graph, equations.variables
    forced = any(np.any(values.get(str(g.leaf[node]), 0.0)) for node in (*v.Q, *v.plain))
    return not forced and any(item.name == H for item in conserved(equations))


def draw_drift(axes: Axes, time: Floats, energies: Mapping[str, Floats], kept: bool) -> None:
    """h - h(0) over ``time`` (times,) in s, and whether it should be zero because h is ``kept``."""
    h = energies[H]
    axes.plot(time, h - h[0], color="C3", **LINE)
    meaning = "drift of the conserved energy h" if kept else "change of the energy h, which is not conserved"
    dressed(axes, f"{meaning}, h = Σ q̇ ∂L/∂q̇ - L", vertical="in J")

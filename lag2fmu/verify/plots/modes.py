"""The modes of contacts, stops and dry frictions over time, as steps."""

from __future__ import annotations

from matplotlib.axes import Axes

from lag2fmu.fmu.elements import ENUMERATIONS, MODE, element_modes
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.picture.labels import pretty
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.plots.figures import LINE, MOST_CURVES, dressed

_APART = 0.06
"""So far are the curves of two elements from each other, that both are seen in the same mode."""


def modes_in(run: Trajectory, mechanism: Mechanism) -> dict[str, str]:
    """{element: variable} of the modes among the columns of ``run``."""
    return {element: name for element, name in element_modes(mechanism).items() if name in run}


def draw_modes(axes: Axes, run: Trajectory, modes: dict[str, str]) -> None:
    """Each of ``modes`` keeps its value until the next time of ``run``."""
    for number, (element, name) in enumerate(list(modes.items())[:MOST_CURVES]):
        shifted = run[name] + _APART * number
        axes.step(run.time, shifted, where="post", color=f"C{number}", label=pretty(element), **LINE)
    dressed(axes, "modes")
    items = ENUMERATIONS[MODE].items
    axes.set_yticks([value for value, _ in items.values()], [name.replace("_", " ") for name in items])
    axes.set_ylim(0.5, len(items) + 0.5 + _APART * MOST_CURVES)
    axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, borderaxespad=0.2)

"""Events in pictures: modes of contacts, stops and dry frictions as steps, impulses, and marks of when they change."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from lag2fmu.description import names
from lag2fmu.fmu.elements import ENUMERATIONS, MODE, element_modes
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.picture.labels import pretty
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.plots.figures import LINE, MOST_CURVES, dressed

Floats = NDArray[np.float64]
Changes = NDArray[np.bool_]

_APART = 0.06
"""So far are the curves of two elements from each other, that both are seen in the same mode."""


def modes_in(run: Trajectory, mechanism: Mechanism) -> dict[str, str]:
    """{element: variable} of the modes among the columns of ``run``."""
    return {element: name for element, name in element_modes(mechanism).items() if name in run}


def impulses_in(run: Trajectory, mechanism: Mechanism) -> dict[str, str]:
    """{contact or side of a stop: variable} of the impulses among the columns of ``run``."""
    found = {u.name: names.impulse(u.name) for u in mechanism.unilaterals}
    return {name: impulse for name, impulse in found.items() if {impulse, names.impacts(name)} <= set(run.names)}


def events_of(run: Trajectory, mechanism: Mechanism) -> Changes:
    """Whether an element changed its mode, or had an impact, between two times of ``run``: (times - 1,)."""
    columns = [*element_modes(mechanism).values(), *(names.impacts(u.name) for u in mechanism.unilaterals)]
    changed = [np.diff(run[name]) != 0 for name in columns if name in run]
    return np.any(changed, axis=0) if changed else np.zeros(len(run) - 1, dtype=bool)


def mark_events(axes: Axes, times: Floats) -> None:
    """Small triangles at the bottom where something changed just before these ``times`` (k,) in s."""
    place = axes.get_xaxis_transform()
    axes.plot(times, np.zeros(len(times)), "^", markersize=4, color="0.35", transform=place, clip_on=False, zorder=3)


def draw_impulses(axes: Axes, run: Trajectory, impulses: dict[str, str], unit: str) -> None:
    """A stem for every time by which impacts happened, as high as the last of them."""
    for number, (name, impulse) in enumerate(list(impulses.items())[:MOST_CURVES]):
        struck = np.append(False, np.diff(run[names.impacts(name)]) > 0)
        axes.vlines(run.time[struck], 0.0, run[impulse][struck], color=f"C{number}", label=pretty(name), **LINE)
    dressed(axes, "impulses of impacts", vertical=unit)
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, borderaxespad=0.2)


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

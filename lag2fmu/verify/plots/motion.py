"""A run in pictures: time histories, energies, and the two spaces of mechanics, of configurations and of phases."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from lag2fmu.analysis import conserved
from lag2fmu.description.names import velocity
from lag2fmu.dynamics import EquationsOfMotion, derive
from lag2fmu.dynamics.samples import start_values
from lag2fmu.graph.batches import evaluate
from lag2fmu.language.units import Unit
from lag2fmu.mechanism import Mechanism
from lag2fmu.picture import drawable, layout_of, posture, pretty
from lag2fmu.reference import Trajectory
from lag2fmu.verify.plots.figures import LINE, MOST_CURVES, dressed, say
from lag2fmu.verify.plots.mechanism import draw_marks

Floats = NDArray[np.float64]

ENERGIES = {"kinetic_energy": "T", "potential_energy": "V", "total_energy": "T + V"}
H = "generalized_energy"
_PHASES, _PLAIN = 4, 12
"""Curves in a phase portrait; panels for a run whose mechanism is not known."""


@dataclass(frozen=True)
class Panel:
    """Columns over time in one panel."""

    names: tuple[str, ...]
    label: str
    title: str


def _states(mechanism: Mechanism) -> tuple[str, ...]:
    q = [c.name for c in mechanism.coordinates]
    return (*q, *map(velocity, q))


def motion_figure(
    title: str, run: Trajectory, mechanism: Mechanism | None = None, signals: Trajectory | None = None
) -> Figure:
    """The ``run`` of ``mechanism``, whose columns are q, qd and its outputs; ``signals`` are the inputs it had.

    Left: coordinates, velocities, energies and outputs over time; right: paths of the bodies, configuration path and
    phase portrait. Without a mechanism, or without q and qd: each column over time.
    """
    if mechanism is None or not set(_states(mechanism)) <= set(run.names):
        return _columns(title, run)
    notes: list[str] = []
    equations = derive(mechanism)
    values = _values(equations.mechanism, run, signals)
    energies = _energies(equations, values)
    panels = _panels(mechanism, run, notes)
    spaces = _spaces(equations.mechanism, run, values, notes)
    histories = len(panels) + 2
    height = max(1.75 * histories, 3.9 * len(spaces), 4.0)
    figure = Figure(figsize=(12, height + 0.7 + 0.2 * len(notes)), layout="constrained")
    figure.suptitle(title, fontsize=14)
    grid = figure.add_gridspec(1, 2, width_ratios=[3, 2])
    left = grid[0].subgridspec(histories, 1)
    first: Axes | None = None
    for row, panel in enumerate(panels):
        axes = figure.add_subplot(left[row], sharex=first)
        first = first or axes
        _draw_panel(axes, run, panel)
    _draw_energies(figure.add_subplot(left[len(panels)], sharex=first), run.time, energies)
    axes = figure.add_subplot(left[len(panels) + 1], sharex=first)
    _draw_drift(axes, run.time, energies[H], equations)
    axes.set_xlabel("time in s", fontsize=9)
    right = grid[1].subgridspec(max(len(spaces), 1), 1)
    for row, space in enumerate(spaces):
        space(figure.add_subplot(right[row]))
    say(figure, notes)
    return figure


def _columns(title: str, run: Trajectory) -> Figure:
    """One panel for each column, as many as can be read."""
    names = run.names[:_PLAIN]
    figure = Figure(figsize=(9, 1.2 + 1.3 * len(names)), layout="constrained")
    for number, (axes, name) in enumerate(
        zip(figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0], names, strict=True)
    ):
        axes.plot(run.time, run[name], color=f"C{number % 10}", **LINE)
        dressed(axes, vertical=name)
    axes.set_xlabel("time in s", fontsize=9)
    figure.suptitle(title, fontsize=14)
    say(figure, _left_out(run.names, _PLAIN, "columns"))
    return figure


def _left_out(names: Sequence[str], most: int, what: str) -> list[str]:
    return [f"Of {len(names)} {what} the first {most} are drawn."] if len(names) > most else []


# ------------------------------------------------------------------------------------------------ over time


def _panels(mechanism: Mechanism, run: Trajectory, notes: list[str]) -> list[Panel]:
    """Coordinates, velocities and outputs, each by unit."""
    groups: dict[str, list[str]] = {}
    for c in mechanism.coordinates:
        groups.setdefault(c.unit.si_name if c.unit is not None else "", []).append(c.name)
    panels = []
    for of, per, rename in (("coordinates", "", str), ("velocities", "/s", velocity)):
        for unit, names in groups.items():
            label = f"in {unit}{per}" if unit not in ("", "1") else ("in 1/s" if per and unit else "")
            panels.append(Panel(tuple(map(rename, names)), label, of))
            notes += _left_out(names, MOST_CURVES, f"{of} {label}".rstrip())
    outputs: dict[str, list[str]] = {}
    for name, output in mechanism.output_names.items():
        if name in run:
            outputs.setdefault(output.unit.si_name if isinstance(output.unit, Unit) else "", []).append(name)
    for unit, names in list(outputs.items())[:2]:
        panels.append(Panel(tuple(names), f"in {unit}" if unit not in ("", "1") else "", "outputs"))
        notes += _left_out(names, MOST_CURVES, "outputs")
    if len(outputs) > 2:
        notes.append(f"Of outputs in {len(outputs)} units those in the first 2 are drawn.")
    return panels


def _draw_panel(axes: Axes, run: Trajectory, panel: Panel) -> None:
    for number, name in enumerate(panel.names[:MOST_CURVES]):
        axes.plot(run.time, run[name], color=f"C{number}", label=_written(name), **LINE)
    dressed(axes, panel.title, vertical=panel.label)
    _legend(axes)


def _written(name: str) -> str:
    """A velocity as a derivative."""
    return f"d{pretty(name.removesuffix('_dot'))}/dt" if name.endswith("_dot") else pretty(name)


def _values(mechanism: Mechanism, run: Trajectory, signals: Trajectory | None) -> dict[str, Floats | float]:
    """The values of all variables along the ``run``; inputs are interpolated as fmpy gives them."""
    values: dict[str, Floats | float] = dict(start_values(mechanism))
    values |= {name: run[name] for name in _states(mechanism)} | {"t": run.time}
    if signals is not None:
        values |= {name: np.interp(run.time, signals.time, signals[name]) for name in signals if name in values}
    return values


def _energies(equations: EquationsOfMotion, values: dict[str, Floats | float]) -> dict[str, Floats]:
    """{energy: (times,)}, of those that the mechanism has."""
    found = {name: equations.energies[name] for name in (*ENERGIES, H) if name in equations.energies}
    numbers = evaluate(equations.graph, list(found.values()), values)
    return dict(zip(found, numbers, strict=True))


def _draw_energies(axes: Axes, time: Floats, energies: dict[str, Floats]) -> None:
    for name, label in ENERGIES.items():
        if name in energies:
            axes.plot(time, energies[name], label=label, **LINE)
    dressed(axes, "energies", vertical="in J")
    _legend(axes)


def _draw_drift(axes: Axes, time: Floats, h: Floats, equations: EquationsOfMotion) -> None:
    """h - h(0), and whether it should be zero."""
    kept = any(item.name == H for item in conserved(equations))
    axes.plot(time, h - h[0], color="C3", **LINE)
    meaning = "drift of the conserved energy h" if kept else "change of the energy h, which is not conserved"
    dressed(axes, f"{meaning}, h = Σ q̇ ∂L/∂q̇ - L", vertical="in J")


def _legend(axes: Axes) -> None:
    axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, borderaxespad=0.2)


# ------------------------------------------------------------------------------------------------ the spaces


def _spaces(
    mechanism: Mechanism, run: Trajectory, values: dict[str, Floats | float], notes: list[str]
) -> list[Callable[[Axes], None]]:
    """What draws each of the panels on the right."""
    q = [c.name for c in mechanism.coordinates]
    spaces: list[Callable[[Axes], None]] = []
    if drawable(mechanism) and mechanism.bodies:
        spaces.append(lambda axes: _draw_paths(axes, mechanism, values))
        notes += _left_out([b.name for b in mechanism.bodies], MOST_CURVES, "bodies' paths")
    if len(q) > 1:
        spaces.append(lambda axes: _draw_configurations(axes, mechanism, run))
        if len(q) > 2:
            notes.append(
                f"The configuration path is that in {pretty(q[0])} and {pretty(q[1])}, of {len(q)} coordinates."
            )
    spaces.append(lambda axes: _draw_phases(axes, mechanism, run))
    alike = _alike(mechanism)
    if len(alike) < len(q):
        notes.append(f"The phase portrait is that of {', '.join(map(pretty, alike))}.")
    return spaces


def _alike(mechanism: Mechanism) -> list[str]:
    """The first coordinates of the first one's unit, which can share a portrait."""
    first = mechanism.coordinates[0].unit
    unit = first.si_name if first is not None else None
    names = [c.name for c in mechanism.coordinates if (c.unit.si_name if c.unit is not None else None) == unit]
    return names[:_PHASES]


def _draw_paths(axes: Axes, mechanism: Mechanism, values: dict[str, Floats | float]) -> None:
    """The bodies' ways, over the mechanism as it stands at the start of the run."""
    layout = layout_of(mechanism)
    flat = layout.at(np.moveaxis(layout.skeleton.positions(values), 1, -1))
    start = {name: float(x if isinstance(x, float) else x[0]) for name, x in values.items()}
    draw_marks(axes, posture(layout, start), 2.0, 0.55)
    for number, body in enumerate(mechanism.bodies[:MOST_CURVES]):
        path = flat[layout.skeleton.place[body.name]]
        axes.plot(*path.T, color=f"C{number}", zorder=4, label=pretty(body.name), linewidth=0.9)
    axes.autoscale_view()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("paths of the bodies", fontsize=10)
    axes.axis("off")
    _legend(axes)


def _draw_configurations(axes: Axes, mechanism: Mechanism, run: Trajectory) -> None:
    one, two = mechanism.coordinates[:2]
    axes.plot(run[one.name], run[two.name], color="C0", linewidth=0.9)
    axes.plot(run[one.name][0], run[two.name][0], "o", color="C3", markersize=4, label="start")
    dressed(axes, "configuration path", *(_axis(mechanism, c.name) for c in (one, two)))
    axes.legend(fontsize=8, loc="best", frameon=False)


def _draw_phases(axes: Axes, mechanism: Mechanism, run: Trajectory) -> None:
    for number, name in enumerate(_alike(mechanism)):
        x, v = run[name], run[velocity(name)]
        axes.plot(x, v, color=f"C{number}", linewidth=0.9, label=pretty(name))
        axes.plot(x[0], v[0], "o", color=f"C{number}", markersize=4)
    several = len(_alike(mechanism)) > 1
    unit = _axis(mechanism, _alike(mechanism)[0]).partition(" in ")[2]
    horizontal, vertical = (f"q in {unit}", f"dq/dt in {unit}/s") if unit else ("q", "dq/dt")
    dressed(axes, "phase portrait", horizontal, vertical)
    if several:
        _legend(axes)


def _axis(mechanism: Mechanism, name: str) -> str:
    unit = next(c.unit for c in mechanism.coordinates if c.name == name)
    return f"{pretty(name)} in {unit.si_name}" if unit is not None and unit.si_name != "1" else pretty(name)

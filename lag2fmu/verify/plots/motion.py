"""A run in pictures: time histories, energies, and the two spaces of mechanics, of configurations and of phases."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from lag2fmu.description.names import velocity
from lag2fmu.dynamics.lagrange import derive
from lag2fmu.dynamics.starts import start_values
from lag2fmu.fmu.elements import element_variables
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.picture.drawing import posture
from lag2fmu.picture.labels import pretty
from lag2fmu.picture.layout import drawable, layout_of
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.plots.energies import draw_drift, draw_energies, energies_of, is_kept
from lag2fmu.verify.plots.figures import LETTERS, LINE, MOST_CURVES, by_unit, dressed, in_units, labelled, legend, say
from lag2fmu.verify.plots.marks import draw_marks
from lag2fmu.verify.plots.modes import draw_impulses, draw_modes, events_of, impulses_in, mark_events, modes_in

Floats = NDArray[np.float64]

_PHASES, _PLAIN, _MOST_UNITS, _POINTS = 4, 12, 2, 1000
"""Curves in a phase portrait; panels for a run whose mechanism is not known; panels of a kind; points of a curve."""


@dataclass(frozen=True)
class Panel:
    """Columns over time in one panel, in one unit."""

    time: Floats
    columns: Mapping[str, Floats]
    label: str
    title: str


def _states(mechanism: Mechanism) -> tuple[str, ...]:
    q = [c.name for c in mechanism.coordinates]
    return (*q, *map(velocity, q))


@mpl.rc_context(LETTERS)
def motion_figure(
    title: str, run: Trajectory, mechanism: Mechanism | None = None, signals: Trajectory | None = None
) -> Figure:
    """The ``run`` of ``mechanism``, whose columns are q, qd and its outputs; ``signals`` are the inputs it had.

    Left: coordinates, velocities, further states, energies, outputs, modes over time; right: paths of the bodies,
    configuration path and phase portrait. Without a mechanism, or without q and qd: each column over time. Raises
    DerivationError where the equations of ``mechanism`` cannot be derived.
    """
    if mechanism is None or not set(_states(mechanism)) <= set(run.names):
        return _columns(title, run)
    notes: list[str] = []
    equations = derive(mechanism)
    values = _values(equations.mechanism, run, signals)
    energies = energies_of(equations, values)
    units = display_units(mechanism)
    smooth = _smooth(mechanism, run)
    panels = _panels(mechanism, run, smooth, signals, units, notes)
    spaces = _spaces(equations.mechanism, smooth, signals, units, notes)
    modes, impulses = modes_in(run, mechanism), impulses_in(run, mechanism)
    events = run.time[1:][events_of(run, mechanism)]
    histories = len(panels) + 2 + bool(modes) + bool(impulses)
    height = max(1.75 * histories, 3.9 * len(spaces), 4.0)
    figure = Figure(figsize=(12, height + 0.7 + 0.2 * len(notes)), layout="constrained")
    figure.suptitle(title, fontsize=14)
    grid = figure.add_gridspec(1, 2, width_ratios=[3, 2])
    left = grid[0].subgridspec(histories, 1)
    first: Axes | None = None
    for row, panel in enumerate(panels):
        axes = figure.add_subplot(left[row], sharex=first)
        first = first or axes
        _draw_panel(axes, panel)
        if len(events):
            mark_events(axes, events)
    draw_energies(figure.add_subplot(left[len(panels)], sharex=first), run.time, energies)
    axes = figure.add_subplot(left[len(panels) + 1], sharex=first)
    draw_drift(axes, run.time, energies, is_kept(equations, values))
    if impulses:
        axes = figure.add_subplot(left[len(panels) + 2], sharex=first)
        draw_impulses(axes, run, impulses, _impulse_unit(mechanism))
    if modes:
        axes = figure.add_subplot(left[-1], sharex=first)
        draw_modes(axes, run, modes)
    axes.set_xlabel("time in s", fontsize=9)
    right = grid[1].subgridspec(max(len(spaces), 1), 1)
    for row, space in enumerate(spaces):
        space(figure.add_subplot(right[row]))
    say(figure, notes)
    return figure


def _impulse_unit(mechanism: Mechanism) -> str:
    """The label of impulses, '' where they differ in their units."""
    units = {v.unit for v, kind, _ in element_variables(mechanism) if kind == "VARIABLE_IMPULSE"}
    unit = units.pop() if len(units) == 1 else None
    return "" if unit is None else f"in {unit.name}"


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


def _panels(
    mechanism: Mechanism,
    run: Trajectory,
    smooth: Trajectory,
    signals: Trajectory | None,
    units: Mapping[str, Unit],
    notes: list[str],
) -> list[Panel]:
    """Inputs, coordinates, velocities, further states and outputs, each by unit."""
    q = [c.name for c in mechanism.coordinates]
    wanted = [
        ("coordinates", smooth, q),
        ("velocities", smooth, list(map(velocity, q))),
        ("further states", run, [z.name for z in mechanism.states if z.name in run]),
        ("outputs", run, [name for name in mechanism.output_names if name in run]),
    ]
    wanted = [("inputs", signals, list(signals.names)), *wanted] if signals is not None else wanted
    panels = []
    for of, source, names in wanted:
        columns, groups = in_units(source, units), by_unit(names, units)
        for unit, alike in list(groups.items())[:_MOST_UNITS]:
            label = f"in {unit}" if unit else ""
            panels.append(Panel(source.time, {name: columns[name] for name in alike}, label, of))
            notes += _left_out(alike, MOST_CURVES, f"{of} {label}".rstrip())
        if len(groups) > _MOST_UNITS:
            notes.append(f"Of {of} in {len(groups)} units those in the first {_MOST_UNITS} are drawn.")
    return panels


def _smooth(mechanism: Mechanism, run: Trajectory) -> Trajectory:
    """q and qd of ``run`` with more times between its own, so that curves look smooth.

    Between two times q is the cubic with the right values and velocities at both (Hermite), qd its derivative; where
    velocities may jump, both are straight.
    """
    straight = events_of(run, mechanism)
    names = [c.name for c in mechanism.coordinates]
    parts = -(-_POINTS // len(run))
    if parts == 1 or len(run) < 2:
        return Trajectory.of(run.time, {name: run[name] for name in _states(mechanism)})
    s = (np.arange(parts) / parts)[:, None]
    h = np.diff(run.time)
    columns = {}
    for name in names:
        (a, b), (v, w) = ((x[:-1], x[1:]) for x in (run[name], run[velocity(name)]))
        rise = b - a
        curve = a + s * (h * v + s * (3 * rise - h * (2 * v + w) + s * (h * (v + w) - 2 * rise)))
        slope = h * v + s * (2 * (3 * rise - h * (2 * v + w)) + s * 3 * (h * (v + w) - 2 * rise))
        columns[name] = np.where(straight, a + s * rise, curve)
        columns[velocity(name)] = np.where(straight, v + s * (w - v), slope / h)
    time = (run.time[:-1] + s * h).T.ravel()
    return Trajectory.of(
        np.append(time, run.time[-1]),
        {name: np.append(columns[name].T.ravel(), run[name][-1]) for name in _states(mechanism)},
    )


def _draw_panel(axes: Axes, panel: Panel) -> None:
    for number, (name, column) in enumerate(list(panel.columns.items())[:MOST_CURVES]):
        axes.plot(panel.time, column, color=f"C{number}", label=_written(name), **LINE)
    dressed(axes, panel.title, vertical=panel.label)
    legend(axes)


def _written(name: str) -> str:
    """The name of a velocity, written as a derivative."""
    return f"d{pretty(name.removesuffix('_dot'))}/dt" if name.endswith("_dot") else pretty(name)


def _values(mechanism: Mechanism, run: Trajectory, signals: Trajectory | None) -> dict[str, Floats | float]:
    """The values of all variables along the ``run``; inputs are interpolated as fmpy gives them."""
    values: dict[str, Floats | float] = dict(start_values(mechanism))
    values |= {name: run[name] for name in _states(mechanism)} | {"t": run.time}
    if signals is not None:
        values |= {name: np.interp(run.time, signals.time, signals[name]) for name in signals if name in values}
    return values


# ------------------------------------------------------------------------------------------------ the spaces


def _spaces(
    mechanism: Mechanism, run: Trajectory, signals: Trajectory | None, units: Mapping[str, Unit], notes: list[str]
) -> list[Callable[[Axes], None]]:
    """What draws each of the panels on the right."""
    q = [c.name for c in mechanism.coordinates]
    shown = in_units(run, units)
    spaces: list[Callable[[Axes], None]] = []
    if drawable(mechanism) and mechanism.placed_bodies:
        spaces.append(lambda axes: _draw_paths(axes, mechanism, _values(mechanism, run, signals)))
        notes += _left_out([b.name for b in mechanism.placed_bodies], MOST_CURVES, "bodies' paths")
    if len(q) > 1:
        spaces.append(lambda axes: _draw_configurations(axes, shown, q[:2], units))
        if len(q) > 2:
            notes.append(
                f"The configuration path is that in {pretty(q[0])} and {pretty(q[1])}, of {len(q)} coordinates."
            )
    alike = next(iter(by_unit(q, units).values()))[:_PHASES]
    spaces.append(lambda axes: _draw_phases(axes, shown, alike, units))
    if len(alike) < len(q):
        notes.append(f"The phase portrait is that of {', '.join(map(pretty, alike))}.")
    return spaces


def _draw_paths(axes: Axes, mechanism: Mechanism, values: dict[str, Floats | float]) -> None:
    """The paths of the bodies, over the mechanism as it stands at the start of the run."""
    layout = layout_of(mechanism)
    flat = layout.at(np.moveaxis(layout.skeleton.positions(values), 1, -1))
    start = {name: float(x if isinstance(x, float) else x[0]) for name, x in values.items()}
    draw_marks(axes, posture(layout, start), 2.0, 0.55)
    for number, body in enumerate(mechanism.placed_bodies[:MOST_CURVES]):
        path = flat[layout.skeleton.place[body.name]]
        axes.plot(*path.T, color=f"C{number}", zorder=4, label=pretty(body.name), linewidth=0.9)
    axes.autoscale_view()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("paths of the bodies", fontsize=10)
    axes.axis("off")
    legend(axes)


def _draw_configurations(
    axes: Axes, shown: Mapping[str, Floats], names: Sequence[str], units: Mapping[str, Unit]
) -> None:
    one, two = (shown[name] for name in names)
    axes.plot(one, two, color="C0", linewidth=0.9)
    axes.plot(one[0], two[0], "o", color="C3", markersize=4, label="start")
    dressed(axes, "configuration path", *(labelled(pretty(name), units.get(name)) for name in names))
    axes.legend(fontsize=8, loc="best", frameon=False)


def _draw_phases(axes: Axes, shown: Mapping[str, Floats], names: Sequence[str], units: Mapping[str, Unit]) -> None:
    for number, name in enumerate(names):
        x, v = shown[name], shown[velocity(name)]
        axes.plot(x, v, color=f"C{number}", linewidth=0.9, label=pretty(name))
        axes.plot(x[0], v[0], "o", color=f"C{number}", markersize=4)
    labels = (labelled("q", units.get(names[0])), labelled("dq/dt", units.get(velocity(names[0]))))
    dressed(axes, "phase portrait", *labels)
    if len(names) > 1:
        legend(axes)

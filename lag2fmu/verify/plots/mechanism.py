"""The mechanism in its start position, and below it its normal modes; without bodies, its potential energy."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from lag2fmu.analysis.equilibria import equilibria
from lag2fmu.analysis.evaluation import at, driven_by_time, operating_inputs
from lag2fmu.analysis.linearization import linearize
from lag2fmu.analysis.modes import NaturalMode, normal_modes
from lag2fmu.analysis.report import with_inputs
from lag2fmu.description.symbols import Coordinate
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.lagrange import derive
from lag2fmu.errors import DerivationError, LoadError
from lag2fmu.graph.batches import Floats, evaluate
from lag2fmu.language.units import DIMENSIONLESS
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.picture.drawing import draw, posture
from lag2fmu.picture.labels import pretty
from lag2fmu.picture.layout import Layout, drawable, layout_of
from lag2fmu.picture.scene import STYLES, Scene, Stroke
from lag2fmu.reference.direct_integration import integrate
from lag2fmu.verify.plots.figures import LETTERS, LINE, dressed, labelled, say
from lag2fmu.verify.plots.marks import draw_marks

_MODES, _ROW, _LISTED = 8, 4, 6
"""Modes that are drawn, and in one row; coordinates of an equilibrium that are written."""
_SWING, _MOST_TURN = 7.0, 0.5
"""How far a mode moves a body at most, in units of the picture, and turns anything (rad)."""

_WIDTH, _HEIGHT, _FINE = 9.0, 5.8, 5.0
"""The most that the scene takes, in inches and in points for a unit of the picture."""

_CORNERS = np.array([[-1.0, -1.0], [1.0, 1.0]])
"""Of a square about a disc of the radius 1."""


@mpl.rc_context(LETTERS)
def mechanism_figure(mechanism: Mechanism) -> Figure:
    """The scene of ``mechanism`` with its normal modes, or its potential energy over q if it has no bodies.

    Raises DerivationError where the equations cannot be derived, LoadError if there is nothing to draw.
    """
    equations = derive(mechanism)
    if drawable(mechanism):
        return _with_modes(equations)
    if mechanism.energy.lagrangian is None and len(mechanism.coordinates) <= 2:
        return _potential(equations)
    raise LoadError(
        f"mechanism '{mechanism.name}' has no bodies or points: there is nothing to draw; give it a point, "
        'e.g. [points.P] position = ["x", "y"]'
    )


# ------------------------------------------------------------------------------------------------ scene and modes


def _with_modes(equations: EquationsOfMotion) -> Figure:
    layout = layout_of(equations.mechanism)
    scene = draw(layout)
    modes, values, sentence = _modes(equations)
    shown = modes[:_MODES]
    notes = [*scene.notes, sentence]
    columns = min(_ROW, max(len(shown), 1))
    rows = -(-len(shown) // columns)
    left, bottom, right, top = scene.box
    wide, high = right - left, top - bottom
    scale = min(_FINE, _WIDTH * 72 / wide, _HEIGHT * 72 / high)
    upper, row = scale * high / 72, min(max(_WIDTH / columns * high / wide, 0.9), 2.6) + 0.4
    figure = Figure(figsize=(_WIDTH * 1.03, upper + row * rows + 0.8 + 0.2 * len(notes)), layout="constrained")
    figure.suptitle(scene.title, fontsize=14)
    grid = figure.add_gridspec(1 + rows, columns, height_ratios=[upper, *[row] * rows])
    _draw_scene(figure.add_subplot(grid[0, :]), scene, scale)
    for number, mode in enumerate(shown):
        axes = figure.add_subplot(grid[1 + number // columns, number % columns])
        _draw_mode(axes, equations, layout, values, mode)
        caption = f"mode {number + 1}: {_rate(mode)}"
        axes.set_title(caption.replace(", ", "\n") if columns > 2 else caption, fontsize=9)
    if len(modes) > len(shown):
        notes.append(f"{len(modes) - len(shown)} faster modes are left out.")
    say(figure, notes)
    return figure


def _modes(equations: EquationsOfMotion) -> tuple[tuple[NaturalMode, ...], dict[str, Any], str]:
    """Modes that vibrate or grow, the state they are about, and a sentence on them or on why there are none."""
    nothing: tuple[NaturalMode, ...] = ()
    if driven_by_time(equations):
        return nothing, {}, "There are no normal modes: the equations change with time."
    found = equilibria(equations, most=1)
    if not found:
        return nothing, {}, "There are no normal modes: no equilibrium was found."
    q = found[0].q
    values = at(equations, operating_inputs(equations), q, np.zeros_like(q), found[0].further)
    try:
        modes = normal_modes(linearize(equations, q, np.zeros_like(q), further=found[0].further))
    except DerivationError as error:
        return nothing, {}, f"There are no normal modes: {str(error).split(': ', 1)[-1]}."
    moving = tuple(mode for mode in modes if mode.eigenvalue != 0 and np.abs(mode.shape).max(initial=0.0) > 0)
    still = len(modes) - len(moving)
    place = _place(equations.mechanism, q)
    rest = f"; {still} without a restoring force" if still else ""
    if not moving:
        return nothing, {}, f"About the equilibrium {place} no motion has a restoring force."
    return moving, values, f"Normal modes about the equilibrium {place}{with_inputs(equations)}{rest}."


def _place(mechanism: Mechanism, q: Floats) -> str:
    """A sentence on where an equilibrium is; of many coordinates it names those that are not zero."""
    units = [c.unit or DIMENSIONLESS for c in mechanism.coordinates]
    values = [
        (f"{pretty(c.name)} = {unit.from_si(x):.4g} {unit.name}".strip(), x)
        for c, unit, x in zip(mechanism.coordinates, units, q, strict=True)
    ]
    if len(values) <= _LISTED:
        return ", ".join(text for text, _ in values)
    moved = [text for text, x in values if x]
    shown = [*moved[:_LISTED], "..."] if len(moved) > _LISTED else moved
    return ", ".join(shown or ["q = 0"]) + (" (the others 0)" if shown and len(moved) <= _LISTED else "")


def _rate(mode: NaturalMode) -> str:
    """Frequency and decay."""
    real, omega = mode.eigenvalue.real, mode.frequency
    if omega <= 1e-9 * abs(mode.eigenvalue):
        return f"{'grows' if real > 0 else 'decays'}, {1 / abs(real):.3g} s"
    return f"{omega / (2 * np.pi):.4g} Hz" + (
        "" if abs(real) < 1e-9 * omega else f", damping ratio {-real / abs(mode.eigenvalue):.2g}"
    )


def _draw_mode(
    axes: Axes, equations: EquationsOfMotion, layout: Layout, values: dict[str, Any], mode: NaturalMode
) -> None:
    """The mechanism at both ends of a swing; the far end is fainter."""
    shape = np.real(mode.shape)
    q = np.array([values[c.name] for c in equations.mechanism.coordinates])
    swing = _amplitude(layout, equations, values, q, shape) * shape
    rest = np.zeros_like(q)
    lines: list[Floats] = []
    for share, alpha in ((-1.0, 0.3), (1.0, 0.9)):
        marks = posture(layout, {**layout.values, **at(equations, values, q + share * swing, rest)})
        lines += [np.array(m.points) if isinstance(m, Stroke) else m.center + m.radius * _CORNERS for m in marks]
        draw_marks(axes, marks, 1.6, alpha)
    low, high = np.vstack(lines).min(axis=0) - 4.0, np.vstack(lines).max(axis=0) + 4.0
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.axis("off")


def _amplitude(layout: Layout, equations: EquationsOfMotion, values: dict[str, Any], q: Floats, shape: Floats) -> float:
    """What to multiply a shape (n,) by, so that it can be seen and stays a small motion."""
    small = 1e-3 / max(float(np.abs(shape).max()), 1e-300)
    spots = sorted(set(layout.skeleton.place.values()))
    rest = np.zeros_like(q)
    places = [
        layout.at(layout.skeleton.positions({**layout.values, **at(equations, values, q + x * small * shape, rest)}))
        for x in (-1.0, 1.0)
    ]
    moved = float(np.linalg.norm((places[1] - places[0])[spots], axis=1).max()) / (2 * small)
    angles = [abs(x) for x, c in zip(shape, equations.mechanism.coordinates, strict=True) if _turns(c)]
    bounds = [_SWING / moved] if moved > 1e-9 else []
    bounds += [_MOST_TURN / max(angles)] if angles and max(angles) > 0 else []
    return min(bounds, default=1.0)


def _turns(coordinate: Coordinate) -> bool:
    return coordinate.unit is not None and coordinate.unit.si_name == "rad"


def _draw_scene(axes: Axes, scene: Scene, scale: float) -> None:
    """The whole scene in the middle of its panel, ``scale`` points (1/72 inch) for a unit of the picture."""
    left, bottom, right, top = scene.box
    draw_marks(axes, scene.marks, scale)
    for label in scene.labels:
        color = STYLES[label.style].color
        axes.text(
            *label.at, label.text, color=color, fontsize=label.size * scale, family="serif", ha="center", va="center"
        )
    margin = (_WIDTH * 72 / scale - (right - left)) / 2
    axes.set_xlim(left - margin, right + margin)
    axes.set_ylim(bottom, top)
    axes.set_aspect("equal")
    axes.axis("off")


# ------------------------------------------------------------------------------------------------ potential energy


def _potential(equations: EquationsOfMotion) -> Figure:
    """V over q with the path from the start: a curve for one coordinate, contours for two."""
    mechanism = equations.mechanism
    path = _path(mechanism)
    start = np.array([c.start for c in mechanism.coordinates])
    reach = np.maximum(np.abs(path - start).max(axis=0), 1e-6)
    middle = (path.max(axis=0) + path.min(axis=0)) / 2
    sides = [np.linspace(m - 1.3 * r, m + 1.3 * r, 161) for m, r in zip(middle, reach, strict=True)]
    mesh = np.array(np.meshgrid(*sides))
    node = [equations.energies["potential_energy"]]
    values = at(equations, operating_inputs(equations), mesh, np.zeros_like(mesh))
    V = evaluate(equations.graph, node, values)[0]
    if np.ptp(V) == 0:
        return _histories(mechanism, path)
    figure = Figure(figsize=(7, 6), layout="constrained")
    axes = figure.subplots()
    units = [c.unit or DIMENSIONLESS for c in mechanism.coordinates]
    labels = [labelled(pretty(c.name), c.unit) for c in mechanism.coordinates]
    sides = [unit.from_si(side) for unit, side in zip(units, sides, strict=True)]
    shown = np.stack([unit.from_si(x) for unit, x in zip(units, path.T, strict=True)])
    if len(sides) == 1:
        axes.plot(sides[0], V, color="0.3", **LINE)
        on_path = evaluate(equations.graph, node, at(equations, values, path.T, 0 * path.T))[0]
        axes.plot(shown[0], on_path, color="C0", linewidth=3, alpha=0.5, label="where it moves")
        axes.plot(shown[0, 0], on_path[0], "o", color="C3", label="start")
        dressed(axes, "potential energy", labels[0], "V in J")
    else:
        filled = axes.contourf(*sides, V, 24, cmap="Blues")
        axes.contour(*sides, V, 24, colors="white", linewidths=0.4)
        figure.colorbar(filled, ax=axes, label="V in J")
        axes.plot(*shown, color="C1", label="path", linewidth=0.9)
        axes.plot(*shown[:, 0], "o", color="C3", label="start")
        dressed(axes, "potential energy and configuration path", *labels)
    axes.legend(fontsize=9)
    figure.suptitle(mechanism.title, fontsize=14)
    say(figure, [f"The mechanism has no bodies to draw; the motion is that of {mechanism.experiment.stop_time:g} s."])
    return figure


def _histories(mechanism: Mechanism, path: Floats) -> Figure:
    """The coordinates over time, ``path`` (times, n), where no potential tells where the motion goes."""
    figure = Figure(figsize=(7, 1.5 + 2.0 * len(mechanism.coordinates)), layout="constrained")
    panels = figure.subplots(len(mechanism.coordinates), 1, sharex=True, squeeze=False)[:, 0]
    time = np.linspace(0.0, mechanism.experiment.stop_time, len(path))
    for axes, c, x in zip(panels, mechanism.coordinates, path.T, strict=True):
        axes.plot(time, (c.unit or DIMENSIONLESS).from_si(x), **LINE)
        dressed(axes, "", "", labelled(pretty(c.name), c.unit))
    panels[-1].set_xlabel("time in s", fontsize=9)
    figure.suptitle(mechanism.title, fontsize=14)
    say(figure, ["The mechanism has no bodies to draw, and its potential energy is constant."])
    return figure


def _path(mechanism: Mechanism) -> Floats:
    """q of the motion, (times, n)."""
    times = np.linspace(0.0, mechanism.experiment.stop_time, 1500)
    run = integrate(mechanism, times, rtol=1e-7).trajectory
    return run.columns([c.name for c in mechanism.coordinates])

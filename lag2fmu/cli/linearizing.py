"""The work of the verb ``linearize``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import pi
from pathlib import Path

import click
from rich.markup import escape
from rich.table import Table

from lag2fmu.analysis.state_files import FORMATS
from lag2fmu.analysis.state_space import Hidden, Quantity, StateSpace
from lag2fmu.cli.options import check_ending, refuse_to_overwrite
from lag2fmu.cli.settings import load_with_inputs
from lag2fmu.cli.terminal import console
from lag2fmu.dynamics.lagrange import derive
from lag2fmu.reference.trajectory import Floats
from lag2fmu.verify.entry_points import linearize

_ROWS = ("states", "states", "outputs", "outputs")
_COLUMNS = ("states", "inputs", "states", "inputs")
"""The names of the rows and columns of A, B, C and D."""

_ROUNDING = 1e-13
"""Entries below this share of the largest one of a matrix are shown as 0."""

_MOST = 12
"""The most columns of a matrix that is printed."""


def linearize_model(
    model: str,
    at: str,
    inputs: tuple[str, ...],
    outputs: tuple[str, ...],
    sample: float | None,
    path: Path | None,
    force: bool,
    settings: tuple[str, ...],
) -> None:
    """Print the state space of ``model`` about the state ``at``, and write it to ``path``.

    With a ``sample`` time (s) the matrices are those of the samples.

    Raises Lag2FmuError for a model, state or names that do not fit.
    """
    if path is not None:
        check_ending(path, FORMATS)
        refuse_to_overwrite(path, force=force)
    mechanism, forces, _ = load_with_inputs(model, settings)
    about = linearize(derive(mechanism), at, inputs=forces, outputs=outputs or None)
    found = about.state_space(inputs or None)
    found = found if sample is None else found.sampled(sample)
    for title, table in _tables(found):
        click.echo(title)
        console().print(table)
    if found.states:
        click.echo(_hidden("controllable", found.uncontrollable))
        click.echo(_hidden("observable", found.unobservable))
    if not found.resting:
        left = "dx/dt" if found.step is None else "the next x"
        click.echo(f"the state at {found.time:g} s is no equilibrium: {left} = drift + A x + B u")
    if path is not None:
        found.save(path)
        click.echo(f"wrote {path}", err=True)


def _tables(found: StateSpace) -> Iterator[tuple[str, Table]]:
    """Titles and tables: the operating point, the poles, and the matrices where they fit on a screen."""
    place = "an equilibrium" if found.resting else f"its state at {found.time:g} s"
    yield f"{found.name} about {place}", _of_quantities(found)
    yield "poles", _of_poles(found)
    letters = {"states": "x", "inputs": "u", "outputs": "y"}
    for name, of_rows, of_columns in zip("ABCD", _ROWS, _COLUMNS, strict=True):
        rows, columns = getattr(found, of_rows), getattr(found, of_columns)
        if rows and columns and len(columns) <= _MOST:
            by = letters[of_columns]
            moved = "dx/dt" if found.step is None else f"x after {found.step:g} s"
            title = f"{name}: dy/d{by}" if of_rows == "outputs" else f"{name}: d({moved})/d{by}"
            yield title, _of_matrix(getattr(found, name), rows, columns)


def _hidden(word: str, hidden: Hidden) -> str:
    """The line on what is not ``word``, "controllable" or "observable"."""
    if not hidden.states:
        return f"{word}: all states"
    values = ", ".join(f"{pole.value:.6g}" if pole.value.imag else f"{pole.value.real:.6g}" for pole in hidden.poles)
    return f"not {word}: {', '.join(hidden.states)}; their own poles: {values} 1/s"


def _of_quantities(found: StateSpace) -> Table:
    table = _table("", "name", "unit", "value there", right=1)
    for kind in ("states", "inputs", "outputs"):
        for i, x in enumerate(getattr(found, kind)):
            table.add_row(kind if i == 0 else "", x.name, escape(x.unit), f"{x.value:.9g}")
    return table


def _of_poles(found: StateSpace) -> Table:
    table = _table("pole [1/s]", "frequency [rad/s]", "[Hz]", "damping", right=4)
    size = max((pole.frequency for pole in found.poles), default=0.0)
    for pole in found.poles:
        value = pole.value
        if value.imag < 0:
            continue  # the row of its conjugate shows both
        shown = f"{value.real:.6g}" if value.imag == 0 else f"{value.real:.6g} ± {value.imag:.6g} i"
        damping = "" if pole.frequency <= 1e-9 * size else f"{pole.damping:.4g}"
        table.add_row(shown, f"{pole.frequency:.6g}", f"{pole.frequency / (2 * pi):.6g}", damping)
    return table


def _of_matrix(values: Floats, rows: Sequence[Quantity], columns: Sequence[Quantity]) -> Table:
    table = _table("", *(x.name for x in columns), right=len(columns))
    size = abs(values).max(initial=0.0)
    for x, row in zip(rows, values, strict=True):
        table.add_row(x.name, *(f"{value if abs(value) > _ROUNDING * size else 0.0:.6g}" for value in row))
    return table


def _table(*headings: str, right: int) -> Table:
    """A table whose last ``right`` columns are numbers."""
    table = Table(box=None, pad_edge=False)
    for i, heading in enumerate(headings):
        table.add_column(escape(heading), justify="right" if i >= len(headings) - right else "left", overflow="fold")
    return table

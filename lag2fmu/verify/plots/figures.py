"""What all figures share: curves, axes, sentences below, saving."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from lag2fmu.errors import ExportError
from lag2fmu.language.units import Unit
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.writing import replacing

Floats = NDArray[np.float64]
LETTERS: Any = {"font.family": "serif"}
"""A font in which I and l can be told apart."""
LINE: dict[str, Any] = {"linewidth": 1.2}
MOST_CURVES = 8
"""At most this many curves stand in one panel; a figure says what it leaves out."""


def dressed(axes: Axes, title: str = "", horizontal: str = "", vertical: str = "") -> None:
    """Title, labels and a faint grid."""
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(horizontal, fontsize=9)
    axes.set_ylabel(vertical, fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(True, alpha=0.3)


def legend(axes: Axes) -> None:
    """The names of the curves, to the right of the panel."""
    axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, borderaxespad=0.2)


def labelled(name: str, unit: Unit | None) -> str:
    """``name in unit``, or the name alone where there is no unit."""
    return f"{name} in {unit.name}".strip() if unit is not None and unit.name else name


def by_unit(names: Iterable[str], units: Mapping[str, Unit]) -> dict[str, list[str]]:
    """{name of a unit, '' for none: the ``names`` in it}, so that each axis has one unit."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(units[name].name if name in units else "", []).append(name)
    return groups


def in_units(run: Trajectory, units: Mapping[str, Unit]) -> dict[str, Floats]:
    """{name: (m,)} of the columns of ``run`` in ``units``."""
    return {name: units[name].from_si(run[name]) if name in units else run[name] for name in run.names}


def say(figure: Figure, sentences: Sequence[str]) -> None:
    """Sentences at the foot of a figure."""
    if sentences:
        width = int(figure.get_figwidth() * 15)
        text = "\n".join(line for sentence in sentences for line in textwrap.wrap(sentence, width))
        figure.supxlabel(text, fontsize=9, color="0.35")


def save(figure: Figure, path: Path) -> None:
    """Write ``figure`` as .png, .svg or .pdf; raises ExportError for another ending or an unwritable path.

    The same figure gives the same SVG: its identifiers are salted, and it carries no date.
    """
    if path.suffix not in (".png", ".svg", ".pdf"):
        raise ExportError(f"'{path}': plots are written as .png, .svg or .pdf")
    metadata = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(path.suffix)
    try:
        with mpl.rc_context({"svg.hashsalt": "lag2fmu"}), replacing(path) as new:
            figure.savefig(new, dpi=150, metadata=metadata)
    except OSError as error:
        raise ExportError(f"cannot write '{path}': {error.strerror}; choose another place") from error

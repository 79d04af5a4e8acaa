"""What all figures share: curves, axes, sentences below, saving."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from lag2fmu.errors import ExportError

LINE: dict[str, Any] = {"linewidth": 1.2}
MOST_CURVES = 8
"""In one panel; a figure says what it leaves out."""


def dressed(axes: Axes, title: str = "", horizontal: str = "", vertical: str = "") -> None:
    """Title, labels and a faint grid."""
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(horizontal, fontsize=9)
    axes.set_ylabel(vertical, fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(True, alpha=0.3)


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
        with mpl.rc_context({"svg.hashsalt": "lag2fmu"}):
            figure.savefig(path, dpi=150, metadata=metadata)
    except OSError as error:
        raise ExportError(f"cannot write '{path}': {error.strerror}; choose another place") from error

"""The record ``Fmu``: an FMU that was exported."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from lag2fmu.archives import PAGE, read_text
from lag2fmu.errors import Lag2FmuError
from lag2fmu.fmu.model_description import ModelDescription
from lag2fmu.mechanism.record import Mechanism


@dataclass(frozen=True)
class Fmu:
    """An FMU that was exported: its path, its model description, and the mechanism it was made of."""

    path: Path
    description: ModelDescription
    solver_choice: str = ""
    """A phrase on why this solver was chosen and how it treats fast vibrations; "" if there is nothing to say."""
    moved_starts: str = ""
    """A phrase on the start values that were moved to meet the constraints; "" if none was."""
    doubt: str = ""
    """A sentence on states of which an observer's samples say nothing; "" if there are none."""

    def __repr__(self) -> str:
        """One line: where it is, of what, with which solver."""
        return f"<Fmu {self.path}: {self.mechanism.title}, solver {self.description.solver}>"

    def _repr_html_(self) -> str:
        """The line of ``repr``, the page of the FMU in a frame, and a table of the variables, for a notebook."""
        from html import escape

        try:
            page = escape(read_text(self.path, PAGE))
        except Lag2FmuError:  # the file is gone
            page = ""
        style = "width: 100%; height: 40em; border: 1px solid silver; background: white"
        frame = f'<iframe style="{style}" srcdoc="{page}"></iframe>' if page else ""
        rows = "".join(
            f"<tr><td>{v.name}</td><td>{v.causality}</td><td>{v.unit.si_name if v.unit else ''}</td>"
            f"<td>{escape(v.doc)}</td></tr>"
            for v in self.description.variables
            if v.causality != "local"
        )
        return f"<p>{escape(repr(self)[1:-1])}</p>{frame}<table>{rows}</table>"

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism that the FMU was made of."""
        return self.description.mechanism


Model = Mechanism | Fmu | str | Path
"""A mechanism, an exported FMU, the path of an FMU, or the name or path of a model."""


def is_fmu(model: object) -> bool:
    """Whether ``model`` is an FMU already (an ``Fmu`` or a path that ends in .fmu)."""
    return isinstance(model, Fmu) or (isinstance(model, (str, Path)) and Path(model).suffix == ".fmu")


def fmu_path(model: object) -> Path:
    """The path of a model for which ``is_fmu`` holds."""
    return model.path if isinstance(model, Fmu) else Path(model)  # type: ignore[arg-type]

"""The live page of a mechanism by itself, without an FMU around it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from lag2fmu.errors import ExportError
from lag2fmu.fmu.backends.backend import Content
from lag2fmu.fmu.backends.native import describe
from lag2fmu.fmu.deriving import derived
from lag2fmu.fmu.documentation import Subject, page_text
from lag2fmu.fmu.live.module import live
from lag2fmu.fmu.live.samples import Samples
from lag2fmu.fmu.picture import scene_at_start
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.progress import telling
from lag2fmu.solvers.methods import METHODS
from lag2fmu.writing import replacing


@telling("making the page")
def page(
    model: Mechanism | str | Path,
    path: str | Path | None = None,
    *,
    solver: str | None = None,
    samples: Samples | None = None,
    values: Mapping[str, float] | None = None,
) -> str:
    """The live page of ``model``, a mechanism or what ``load`` takes, as HTML that needs nothing else.

    It is the page of an FMU with the same ``solver``, and other ``values`` (SI) of parameters and starts if given. It
    compares its trajectory with ``samples`` of a direct integration, and is written to ``path`` if one is given. Raises
    LoadError, ExportError, DerivationError or BuildError.
    """
    if path is not None and not Path(path).parent.is_dir():
        raise ExportError(f"cannot write '{path}': its folder does not exist; create it, or choose another with -o")
    mechanism = as_mechanism(model, values)
    if solver is not None and solver not in METHODS:
        raise ExportError(f"unknown solver '{solver}'; known are {', '.join(METHODS)}")
    found = derived(mechanism, solver)
    description, sources = describe(found.mechanism, found.equations, found.program, found.solver, found.vibrations)
    content = Content(description, {}, "", (), live(found.equations, found.program, description.variables, sources)())
    scene = scene_at_start(found.equations)
    text = page_text(Subject(found.equations, found.program, content, found.reason, scene, samples))
    if path is not None:
        try:
            with replacing(path) as new:
                new.write_text(text, "utf-8", newline="\n")
        except OSError as error:
            raise ExportError(f"cannot write '{path}': {error.strerror}; choose another place with -o") from error
    return text

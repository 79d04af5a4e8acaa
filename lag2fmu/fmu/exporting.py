"""From a mechanism to an FMU: derive, lower, render, compile, pack."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from lag2fmu.archives import pack
from lag2fmu.errors import ExportError
from lag2fmu.fmu.advice import damping, moved_starts, steps_over_impacts
from lag2fmu.fmu.backends.backend import Backend, Choices, Content
from lag2fmu.fmu.backends.native import NATIVE
from lag2fmu.fmu.backends.python import PYTHON
from lag2fmu.fmu.compilers import Progress
from lag2fmu.fmu.contents import CLOCKS, DESCRIPTION, EQUATIONS, MECHANISM_ENTRY, SOURCES, WITHOUT
from lag2fmu.fmu.deriving import Derived, derived
from lag2fmu.fmu.documentation import Subject, documentation
from lag2fmu.fmu.exported import Fmu, Model, fmu_path, is_fmu
from lag2fmu.fmu.icon import icon
from lag2fmu.fmu.live.module import page_maker
from lag2fmu.fmu.materials import BILL_ENTRY, bill_of_materials
from lag2fmu.fmu.observers import observed
from lag2fmu.fmu.picture import scene_at_start
from lag2fmu.fmu.realtime import REAL_TIME, RealTime, check_profile
from lag2fmu.fmu.sources import FORMS, MANY, SINGLE
from lag2fmu.fmu.terminals import terminals
from lag2fmu.fmu.versions import VERSIONS
from lag2fmu.fmu.versions.version import Version
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.formats.write import write
from lag2fmu.language.given import check_names
from lag2fmu.mechanism.leaving_out import OMISSIBLE, leaving_out
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.progress import telling
from lag2fmu.solvers.methods import DEFAULT_SOLVER, METHODS

if TYPE_CHECKING:
    from lag2fmu.analysis.observing import Observing
    from lag2fmu.fmu.live.samples import Samples

BACKENDS: Mapping[str, Backend] = {backend.name: backend for backend in (NATIVE, PYTHON)}
"""The backends by name, the default first."""

TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"
STARTS = ("given", "equilibrium")
_NOT_IN_XML = re.compile("[\0-\b\v\f\x0e-\x1f\ud800-\udfff\ufffe\uffff]")
"""Characters that no XML document can hold (XML 1.0, production 2)."""


@telling("exporting the FMU")
def export(  # noqa: PLR0913 (choices of the user)
    model: Mechanism | str | Path,
    path: str | Path | None = None,
    *,
    solver: str | None = None,
    compiler: str = "zig",
    platform: str = "host",
    backend: str = "c",
    outputs: Sequence[str] = (),
    extra: Mapping[str, bytes] | None = None,
    progress: Progress | None = None,
    fmi: str = "2.0",
    arrays: bool = False,
    start: str = "given",
    inverse: str | Sequence[str] = (),
    time_constant: float | None = None,
    without: Sequence[str] = (),
    page: str | None = None,
    samples: Samples | None = None,
    values: Mapping[str, float] | None = None,
    profile: str = "desktop",
    step: float | None = None,
    sources: str = MANY,
    observer: Observing | None = None,
) -> Fmu:
    """Write the FMU of ``model``, a mechanism or what ``load`` takes, to ``path`` (default: NAME.fmu here).

    - ``solver``: the integrator of co-simulation, see METHODS; by default one that suits the motion at the start.
    - ``compiler``: 'zig' or 'host'; ``platform``: 'host', a name in PLATFORMS, or 'all'.
    - ``backend``: 'c', or 'python' for a slave of PythonFMU.
    - ``outputs``: local variables that become outputs too; 'all' stands for each of them.
    - ``extra``: further files, {name in the archive: content}.
    - ``progress``: told how the compiler gets on.
    - ``fmi``: the version of the standard, a name in VERSIONS.
    - ``arrays``: coordinates and the variables that belong to them are arrays, which FMI 3.0 has.
    - ``start``: "given", or "equilibrium" for a start at rest in the equilibrium found from the given start.
    - ``inverse``: coordinates that are prescribed, or "all", see ``lag2fmu.analysis.inverse``; forces, powers and
      multipliers that their motions need are outputs.
    - ``time_constant``: that of a filter (s), by which positions alone are inputs of the ``inverse``.
    - ``without``: what is left out: files and variables of WITHOUT, parts of the mechanism of OMISSIBLE.
    - ``page``: "live", a page in which the mechanism moves, or "static"; by default live where that costs little.
    - ``samples``: a direct integration, with which a live page compares its trajectory.
    - ``values``: other parameters and starts, in SI units.
    - ``profile``: one of PROFILES; in "realtime" a communication step has a bound: at most ``step`` (s), by default
      that of the experiment, solver steps of fixed length, and no memory is allocated after instantiation.
    - ``sources``: the C code in "many" files, or in a "single" one.
    - ``observer``: the FMU estimates the states from what is measured, see ``lag2fmu.analysis.observing``.

    Raises LoadError, ExportError, DerivationError or BuildError.
    """
    _check_parts(without, sources, backend)
    _check_given(observer, outputs)
    _check_words(DEFAULT_SOLVER if solver is None else solver, backend, fmi, start, arrays=arrays)
    given = leaving_out(as_mechanism(model, values), [word for word in without if word in OMISSIBLE])
    mechanism, needs = _prescribed(_started(given, start), inverse, time_constant)
    check_profile(profile, backend, step)
    if observer:
        mechanism, solver, page = observed(mechanism, solver, backend, profile, page)
        without = (*without, DESCRIPTION)  # what it carries would be the mechanism, not its observer
    named, version, maker = solver or DEFAULT_SOLVER, VERSIONS[fmi], page_maker(page)
    realtime, chosen = RealTime(step) if profile == REAL_TIME else None, BACKENDS[backend]
    choices = Choices(named, platform, compiler, progress, version, arrays, without, maker, realtime, sources, observer)
    build, target = chosen.prepare(choices), Path(f"{mechanism.name}.fmu" if path is None else path)
    _check_target(target)
    _check_texts(mechanism)
    ticking, wanted = version.has_ports and CLOCKS not in without, (*outputs, *needs)
    found = derived(mechanism, solver, chosen.solvers, wanted, events=ticking, bounded=realtime is not None)
    mechanism, equations, program = found.mechanism, found.equations, found.program
    content, scene = build(mechanism, equations, program, found.solver, found.vibrations), scene_at_start(equations)
    told = documentation(Subject(equations, program, content, found.reason, scene, samples, without))
    described = {} if DESCRIPTION in without else {MECHANISM_ENTRY: write(mechanism).encode()}
    files = {**_files(content, version, icon(scene)), **described, **told, **(extra or {})}
    made_by = compiler if backend == NATIVE.name else None
    pack({**files, BILL_ENTRY: bill_of_materials(mechanism.name, files, solver=found.solver, compiler=made_by)}, target)
    return Fmu(target, content.description, _remarks(found), moved_starts(mechanism, equations), content.doubt)


def _remarks(found: Derived) -> str:
    """Phrases on why the solver was chosen, how it treats fast vibrations, and what it does at impacts."""
    method = METHODS[found.solver]
    at_events = steps_over_impacts(found.mechanism, method)
    return "; ".join(filter(None, [found.choice, damping(found.missed, method), at_events]))


def _started(mechanism: Mechanism, start: str) -> Mechanism:
    """``mechanism`` with the ``start`` that one of STARTS names."""
    if start == STARTS[0]:
        return mechanism
    from lag2fmu.analysis.at_rest import resting

    return resting(mechanism)


def _prescribed(
    mechanism: Mechanism, motions: str | Sequence[str], time_constant: float | None
) -> tuple[Mechanism, tuple[str, ...]]:
    """``mechanism`` with prescribed ``motions``, and the names of what they need; itself if there are none."""
    if motions:
        from lag2fmu.analysis.inverse import inverse as inverse_of
        from lag2fmu.analysis.inverse import needed

        mechanism = inverse_of(mechanism, motions, time_constant=time_constant)
        return mechanism, needed(mechanism)
    if time_constant is not None:
        raise ExportError("time_constant: it filters the motions of inverse dynamics; name these by inverse, or 'all'")
    return mechanism, ()


def _files(content: Content, version: Version, drawn: bytes) -> dict[str, bytes]:
    """{name in the archive: content} of what the backend made, its description, its terminals and its icon."""
    return {
        **content.files,
        "modelDescription.xml": version.to_xml(content.description),
        TERMINALS: terminals(content.description, icon=Path(version.icon).parent == Path(TERMINALS).parent),
        version.icon: drawn,
    }


@contextmanager
def as_fmu(model: Model, solver: str | None = None, fmi: str = "2.0") -> Iterator[Path]:
    """The path of an FMU of ``model``; any other model is exported to a folder that is removed at the end.

    Raises Lag2FmuError if there is no such model, if it cannot be exported, and for a ``solver`` of what is an FMU.
    """
    if is_fmu(model):
        if solver is not None:
            raise ExportError(f"'{fmu_path(model)}' is an FMU: its solver was chosen at its export; give the model")
        yield fmu_path(model)
        return
    mechanism = as_mechanism(model)
    with tempfile.TemporaryDirectory(prefix="lag2fmu-") as folder:
        path = Path(folder) / f"{mechanism.name}.fmu"
        # nobody reads the page of this FMU
        yield export(mechanism, path, solver=solver, fmi=fmi, page="static", without=(EQUATIONS,)).path


def _check_words(solver: str, backend: str, fmi: str, start: str, *, arrays: bool) -> None:
    """Raise ExportError for words that are unknown, and for arrays in a version that has none."""
    known = {"solver": METHODS, "backend": BACKENDS, "version of FMI": VERSIONS, "start": STARTS}
    for (what, words), word in zip(known.items(), (solver, backend, fmi, start), strict=True):
        if not isinstance(word, str) or word not in words:
            known_are = f"give it as a text, '{word}'" if str(word) in words else f"known are {', '.join(words)}"
            raise ExportError(f"unknown {what} {word!r}; {known_are}")
    if arrays and not VERSIONS[fmi].has_ports:
        raise ExportError(f"--arrays: FMI {fmi} has no arrays; add --fmi 3.0, or leave --arrays out")


def _check_parts(without: Sequence[str], form: str, backend: str) -> None:
    """Raise ExportError for parts that cannot be left out, and for a ``form`` of C code that there is not."""
    for word in without:
        if word not in WITHOUT and word not in OMISSIBLE:
            raise ExportError(f"--without {word}: known are {', '.join((*WITHOUT, *OMISSIBLE))}")
    if form not in FORMS:
        raise ExportError(f"--sources {form}: known are {', '.join(FORMS)}")
    if form == SINGLE and backend != NATIVE.name:
        raise ExportError(f"--sources {form}: the backend '{backend}' has no C code; leave one of them out")
    if form == SINGLE and SOURCES in without:
        raise ExportError(f"--sources {form}: --without {SOURCES} leaves the C code out; take one of them")


def _check_given(observer: object, outputs: object) -> None:
    """Raise ExportError for an ``observer`` that is no Observing, as a word is, LoadError for outputs in one text."""
    check_names("outputs", outputs)
    if observer is None:
        return
    from lag2fmu.analysis.observing import Observing

    if not isinstance(observer, Observing):
        raise ExportError(
            f"observer: {observer!r} says not what is measured; give lag2fmu.analysis.observing.Observing"
        )


def _check_target(path: Path) -> None:
    """Raise ExportError, before any work, for a path that cannot be written."""
    try:
        path.exists()
    except OSError as error:
        raise ExportError(
            f"cannot write '{str(path)[:60]}...': {error.strerror}; choose another name with -o"
        ) from error
    if path.is_dir():
        raise ExportError(f"the output '{path}' is a folder; name a file, e.g. '{path / 'model.fmu'}'")
    if path.suffix != ".fmu":
        raise ExportError(f"the output '{path}' does not end in .fmu; importers know FMUs by this ending")
    if not path.parent.is_dir():
        raise ExportError(f"the folder '{path.parent}' does not exist; create it or choose another one with -o")


def _check_texts(mechanism: Mechanism) -> None:
    """Raise ExportError for titles and descriptions that modelDescription.xml cannot hold."""
    texts = {"title": mechanism.title, "source": mechanism.provenance, **mechanism.imprint}
    for table in ("coordinates", "states", "parameters", "inputs", "outputs"):
        texts |= {f"{table}.{part.name}.doc": part.doc for part in getattr(mechanism, table)}
    for place, text in texts.items():
        found = _NOT_IN_XML.search(text)
        if found is not None:
            raise ExportError(
                f"mechanism '{mechanism.name}', {place}: "
                f"the character {found.group()!r} cannot stand in an FMU; remove it"
            )

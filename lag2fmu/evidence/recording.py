"""``record``: FMUs with reference values and what tools of others said of them."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from lag2fmu.deadline import LIMIT
from lag2fmu.errors import ExportError
from lag2fmu.evidence.checks import verdicts_of
from lag2fmu.evidence.files import BEGINS, OVERVIEW, README, TOOLS, overview, record_files, tools_entry
from lag2fmu.evidence.verdict import Verdict
from lag2fmu.fmu.exporting import export
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.verify.reference_files import reference_files, reference_of

_LISTED = ("macOS", "Linux", "Windows", "Source Code")
"""Words of the FMI project's list for the platforms that lag2fmu exports for."""


def record(
    models: Sequence[Mechanism | str | Path],
    folder: str | Path,
    *,
    fmi: str = "2.0",
    platform: str = "host",
    limit: float = LIMIT,
    told: Callable[[str], None] = lambda sentence: None,
) -> Mapping[str, Sequence[Verdict]]:
    """Write the record of each of ``models`` below ``folder``: {name of the mechanism: verdicts}.

    For each there is a folder NAME with NAME.fmu, reference values NAME_ref.csv from an independent path, the options
    of its run NAME_ref.opt, the inputs NAME_in.csv where there are any, and Readme.txt with what checkers and installed
    importers said. Beside them are a table of all, README.md, and the entry for the FMI project's list of tools,
    tools.json. An earlier record of the same mechanism is replaced; the table names the mechanisms of this call.

    - ``fmi``: the version of the standard; ``platform``: as in ``export``, the host's among them.
    - ``limit``: CPU time (s) of the direct integration of each; where it is over, the reference ends.
    - ``told``: called with a sentence before each step of the work.

    Raises LoadError, ExportError, DerivationError, BuildError or SimulationError; ExportError also for a folder with
    files that are no record. Nothing is left of a record that did not come to its end.
    """
    mechanisms = [as_mechanism(model) for model in models]
    names = [mechanism.name for mechanism in mechanisms]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ExportError(f"two of the models are named '{twice}', and so would be their folders; rename one of them")
    folder = Path(folder)
    _refuse_files_of_others(folder)
    for name in names:
        _refuse_others(folder / name, name)
    found: dict[str, Sequence[Verdict]] = {}
    with tempfile.TemporaryDirectory(prefix="lag2fmu-") as place:
        for mechanism in mechanisms:
            made = Path(place, mechanism.name)
            made.mkdir()
            found[mechanism.name] = _record_one(mechanism, made, fmi, platform, limit, told)
            _replace(folder / mechanism.name, made)
    (folder / OVERVIEW).write_text(overview(found), "utf-8", newline="\n")
    (folder / TOOLS).write_text(tools_entry(_LISTED), "utf-8", newline="\n")
    return found


def _record_one(
    mechanism: Mechanism, place: Path, fmi: str, platform: str, limit: float, told: Callable[[str], None]
) -> list[Verdict]:
    """Write the files of the record of ``mechanism`` to ``place``; what tools said of its FMU."""
    told(f"{mechanism.name}: integrating directly")
    reference = reference_of(mechanism, limit=limit)
    told(f"{mechanism.name}: exporting")
    extra = reference_files(mechanism, reference)
    fmu = export(mechanism, place / f"{mechanism.name}.fmu", fmi=fmi, platform=platform, extra=extra)
    told(f"{mechanism.name}: asking checkers and importers")
    verdicts = verdicts_of(fmu, fmi, reference)
    for name, text in record_files(fmu, fmi, reference, verdicts).items():
        (place / name).write_text(text, "utf-8", newline="\n")
    return verdicts


def _refuse_files_of_others(folder: Path) -> None:
    """Raise ExportError where ``folder`` is a file, or a table or an entry of others stands where ours would."""
    if folder.exists() and not folder.is_dir():
        raise ExportError(f"'{folder}' is a file, where the folder of records has to stand; choose another with -o")
    for name, begin in BEGINS.items():
        file = folder / name
        if file.exists() and not (file.is_file() and file.read_bytes().startswith(begin.encode())):
            raise ExportError(f"'{file}' was not written by 'lag2fmu record'; move it away, or choose another with -o")


def _refuse_others(folder: Path, name: str) -> None:
    """Raise ExportError where ``folder`` is a file, or holds files that are no record of the mechanism ``name``."""
    if not folder.exists():
        return
    if not folder.is_dir():
        raise ExportError(f"'{folder}' is a file, where the folder of a record has to stand; choose another with -o")
    readme = folder / README
    of_a_record = readme.is_file() and readme.read_bytes().startswith(f"{name}.fmu: ".encode())
    own = {README, f"{name}.fmu", f"{name}_ref.csv", f"{name}_ref.opt", f"{name}_in.csv"} if of_a_record else set()
    others = sorted(path.name for path in folder.iterdir() if path.name not in own)
    if others:
        raise ExportError(
            f"'{folder}' holds '{others[0]}', which is no file of a record; move it away, or choose another with -o"
        )


def _replace(folder: Path, made: Path) -> None:
    """Put the files of ``made`` in the place of ``folder``; raises ExportError if it cannot be written."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".lag2fmu-", dir=folder.parent) as beside:
            shutil.copytree(made, Path(beside, "new"))
            if folder.exists():
                folder.replace(Path(beside, "old"))
            Path(beside, "new").replace(folder)
    except OSError as error:
        raise ExportError(f"'{folder}' cannot be written: {error.strerror or error}; choose another with -o") from error

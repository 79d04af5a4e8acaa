"""The process that runs an FMU: ``python -m lag2fmu.checking.child FOLDER JOURNAL LABELS KIND=LIBRARY...``.

FOLDER holds modelDescription.xml and resources/. LABELS names the trials, one a line. The journal gets a line of JSON
at the begin of each trial, for each finding, and at its end. So the parent process knows what was done if the FMU takes
this process down.
"""

from __future__ import annotations

import json
import locale
import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import TextIO

from lag2fmu.archives import DESCRIPTION
from lag2fmu.checking.binding import RefusedError, bounded
from lag2fmu.checking.description import FmuDescription, read_document
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.rulebook import Rulebook
from lag2fmu.checking.rulebooks import rulebook_of
from lag2fmu.checking.session import Model
from lag2fmu.checking.trials import ESSENTIAL
from lag2fmu.checking.versions import described


def main(folder: Path, journal: Path, libraries: dict[str, Path], labels: list[str]) -> None:
    """Do the trials ``labels``, each 'KIND: name', and write the journal.

    Raises LoadError where the FMU cannot be read.
    """
    bounded()
    document = read_document((folder / DESCRIPTION).read_bytes())
    rules = rulebook_of(document)
    description = described(document)
    with journal.open("a", encoding="utf-8") as stream:
        for label in labels:
            kind, name = label.split(": ", 1)
            _write(stream, {"begin": label})
            failed = False
            for finding in findings_of(rules, description, kind, name, folder, libraries[kind]):
                failed |= finding.rule in ("load", "refused")
                _write(stream, {"finding": asdict(finding)})
            _write(stream, {"end": label, "failed": failed})
            if failed and name in ESSENTIAL:
                return


def _write(stream: TextIO, record: object) -> None:
    """Write one line; a line that the FMU may have begun in the file is ended first."""
    stream.write("\n" + json.dumps(record) + "\n")
    stream.flush()


def findings_of(
    rules: Rulebook, description: FmuDescription, kind: str, name: str, folder: Path, library: Path
) -> Iterator[Finding]:
    """The findings of a trial; an error that stops it is one of them."""
    before = _surroundings()
    try:
        model = rules.model(description, kind, folder, library)
    except OSError as error:
        remedy = "build it for this machine, with all that it needs"
        yield Finding("load", kind, f"the library cannot be loaded: {error}", remedy)
        return
    try:
        yield from rules.trials(kind)[name](model)
    except RefusedError as refused:
        yield Finding("refused", kind, f"in the trial '{name}', {refused}", f"answer legal calls with {model.prefix}OK")
    except RecursionError as error:
        yield Finding("events", kind, str(error), "ask for no further event iteration when nothing changes any more")
    except AttributeError as error:
        yield Finding("refused", kind, f"in the trial '{name}', a function is missing: {error}", "export all functions")
    except OSError as error:
        problem = f"in the trial '{name}', the process loses its folder: {error.strerror}"
        yield Finding("environment", kind, problem, "leave the folders of the importer as they are")
    yield from _categories(description, kind, model)
    for misuse in sorted(model.log.misuses):
        yield Finding(
            "array", kind, f"in the trial '{name}', {misuse}", "write to each element that is asked for alone"
        )
    yield from _changes(kind, name, before)


def _surroundings() -> dict[str, object]:
    """What an FMU has to leave as it is, with what it is now."""
    tiny, one = sys.float_info.min, 1.0
    rounding = (one + 2.0**-53 == one, -one - 2.0**-53 == -one, one - 2.0**-54 == one, tiny * 0.5 > 0.0)
    return {
        "the current folder": _folder(),
        "the locale": locale.setlocale(locale.LC_ALL),
        "how the processor rounds numbers": rounding,
    }


def _folder() -> str:
    try:
        return str(Path.cwd())
    except OSError:  # it is deleted, which is said elsewhere
        return ""


def _changes(kind: str, name: str, before: dict[str, object]) -> Iterator[Finding]:
    """What of the process a trial has changed; it gets its folder and locale back for the next one."""
    for what, now in _surroundings().items():
        if now != before[what] and now:
            problem = f"in the trial '{name}', it changes {what} of the process"
            yield Finding("environment", kind, problem, "leave the process of the importer as it is")
    with suppress(OSError):
        os.chdir(str(before["the current folder"]))
    locale.setlocale(locale.LC_ALL, str(before["the locale"]))


def _categories(description: FmuDescription, kind: str, model: Model) -> Iterator[Finding]:
    """The categories that were used without being declared."""
    declared = {c.get("name") for c in description.root.all("LogCategories", "Category")}
    used = {category for _, category, _ in model.log.sentences if category}
    for category in sorted(used - declared) if declared else ():
        problem = f"logs in the category '{category}', which LogCategories lacks"
        yield Finding("log-category", kind, problem, "declare it", "warning")


if __name__ == "__main__":
    pairs = (argument.split("=", 1) for argument in sys.argv[4:])
    unpacked, written, trials = (Path(argument) for argument in sys.argv[1:4])
    main(unpacked, written, {k: Path(v) for k, v in pairs}, trials.read_text("utf-8").splitlines())

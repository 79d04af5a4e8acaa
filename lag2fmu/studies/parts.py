"""Parts of a sweep on disk, so that an interrupted sweep can go on.

While the sweep runs, the folder FILE.parts stands beside the result FILE. It holds a description of the sweep
(sweep.json), and a file for each part that is done. A part is written under another name and moved into place, so that
it is there whole or not at all. The folder is removed when the result is written.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from lag2fmu.errors import LoadError
from lag2fmu.studies.design import Design, SweepTask, TaskResults
from lag2fmu.version import VERSION
from lag2fmu.writing import replacing

MANIFEST = "sweep.json"


class PartStore:
    """The parts of one sweep in the folder beside its result; None as path keeps them in memory."""

    def __init__(self, path: Path | None, task: SweepTask, design: Design, size: int) -> None:
        """Open or begin it; raises LoadError where the folder belongs to another sweep."""
        self.size, self.count = size, -(-len(design) // size)
        self._memory: dict[int, TaskResults] = {}
        self.folder = None if path is None else path.with_name(f"{path.name}.parts")
        if self.folder is None:
            return
        manifest = {"lag2fmu": VERSION, "sweep": _fingerprint(task, design), "runs": len(design), "part": size}
        try:
            if self.folder.exists():
                self._check(self.folder, manifest)
            else:
                self.folder.mkdir()
                _write(self.folder / MANIFEST, json.dumps(manifest, indent=1).encode())
        except OSError as error:
            raise LoadError(f"'{self.folder}' cannot be used: {error.strerror or error}; choose another -o") from error

    def _check(self, folder: Path, manifest: dict[str, object]) -> None:
        try:
            found = json.loads((folder / MANIFEST).read_text("utf-8"))
        except (OSError, ValueError):
            found = None
        if not isinstance(found, dict) or {**found, "part": 0} != {**manifest, "part": 0}:
            raise LoadError(
                f"'{folder}' holds parts of another sweep (other model, values, outputs or version); "
                "delete it, or choose another name for the result"
            )
        self.size = int(found["part"])
        self.count = -(-int(found["runs"]) // self.size)

    def rows(self, number: int) -> slice:
        """The runs of a part."""
        return slice(number * self.size, (number + 1) * self.size)

    def missing(self) -> list[int]:
        """The numbers of the parts that are not done."""
        return [i for i in range(self.count) if not self._there(i)]

    def _there(self, number: int) -> bool:
        return number in self._memory if self.folder is None else (self.folder / f"{number}.npz").is_file()

    def put(self, number: int, part: TaskResults) -> None:
        """Keep a part that is done."""
        if self.folder is None:
            self._memory[number] = part
            return
        failed, reasons = list(part.reasons), [part.reasons[i] for i in part.reasons]
        with replacing(self.folder / f"{number}.npz") as new, new.open("wb") as file:
            np.savez(file, values=part.values, failed=np.array(failed, dtype=int), reasons=np.array(reasons, dtype=str))

    def parts(self) -> Iterator[TaskResults]:
        """All parts, in order; raises LoadError for a file that is damaged."""
        for i in range(self.count):
            yield self._memory[i] if self.folder is None else self._load(self.folder / f"{i}.npz")

    @staticmethod
    def _load(file: Path) -> TaskResults:
        try:
            with np.load(file, allow_pickle=False) as found:
                reasons = dict(zip(found["failed"].tolist(), found["reasons"].tolist(), strict=True))
                return TaskResults(found["values"], reasons)
        except (OSError, ValueError, KeyError) as error:
            raise LoadError(f"'{file}' is damaged: {error}; delete it and run the sweep again") from error

    def leave(self) -> None:
        """The sweep ends before its end: what is done stays, and nothing where nothing is done."""
        if len(self.missing()) == self.count:
            self.remove()

    def remove(self) -> None:
        """Remove the folder of the parts, as where the result is written."""
        if self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)


def _write(path: Path, content: bytes) -> None:
    with replacing(path) as new:
        new.write_bytes(content)


def _fingerprint(task: SweepTask, design: Design) -> str:
    """A hash of everything that the results of a sweep depend on."""
    digest = hashlib.sha256()
    model = b"".join(hashlib.sha256(Path(file).read_bytes()).digest() for file in task.files) or task.model.encode()
    run, signals = task.run, task.run.inputs
    inputs = None if signals is None else (signals.names, signals.time.tobytes(), signals.values.tobytes())
    values = sorted((run.values or {}).items())
    choices = (task.names, task.outputs, run.tolerance, task.solver, run.step, values, run.hold, inputs)
    for part in (model, design.values.tobytes(), task.times.tobytes(), repr(choices).encode()):
        digest.update(hashlib.sha256(part).digest())
    return digest.hexdigest()

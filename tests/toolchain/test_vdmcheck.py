"""The FMI VDM checker, a formal model of the standard (Battle et al., INTO-CPS): no finding in both of its models.

Its jars come from Maven Central into a cache outside of the repository; they are called, never shipped (GPL).
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import zipfile
from collections.abc import Iterator
from pathlib import Path
from threading import Timer

import pytest
from chosen import KINDS
from hosts import REPRESENTATIVE, representative

from lag2fmu.fmu import Fmu, export
from lag2fmu.formats.loading import load

pytestmark = pytest.mark.toolchain

ARTIFACTS = (
    *(("org.into-cps.vdmcheck.fmi2", name, "1.1.3") for name in ("vdmcheck2", "rule-model", "static-model")),
    *(("org.into-cps.vdmcheck", name, "1.1.3") for name in ("xsd2vdm", "fmuReader")),
    *(("dk.au.ece.vdmj", name, "4.5.0") for name in ("vdmj", "annotations")),
)
"""Groups, names and versions of the jars in Maven Central; NAME.jar is what the checker expects beside itself."""
ALONE = "<exclusions><exclusion><groupId>*</groupId><artifactId>*</artifactId></exclusion></exclusions>"
"""Of an artifact: without what it depends on."""
PROJECT = "<project><modelVersion>4.0.0</modelVersion>{0}<dependencies>{1}</dependencies></project>"
COORDINATES = "<groupId>{}</groupId><artifactId>{}</artifactId><version>{}</version>"
COPY = "org.apache.maven.plugins:maven-dependency-plugin:3.6.1:copy-dependencies"
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "lag2fmu-tests" / "vdmcheck-1.1.3"

CLASSES = os.pathsep.join(("vdmj.jar", "annotations.jar", "xsd2vdm.jar", "fmuReader.jar"))
PROPERTIES = (
    *("-Dvdmj.parser.merge_comments=true", "-Dfmureader.noschema=true"),
    "-Dfmureader.xsd=fmi2schema/fmi2.xsd",
)
QUESTION = "isValidFMIConfigurations(modelDescription, buildDescription, terminalsAndIcons)"
"""What vdmcheck2.jar asks VDMJ, and how it starts it."""
QUICK_START = ("-XX:TieredStopAtLevel=1", "-XX:+UseSerialGC", "-Xmx1g")
LONGEST = 300.0
"""s"""
BOUNDED = ("sh", "-c", 'ulimit -t 600; exec "$@"', "sh")
"""An interpreter that is left alone listens in a circle; the limit of its processor time (s) ends that."""
ASIDE = re.compile(r"Executed in |Running .* for |\[p\]ause|\[q\]uit")
"""What the interpreter says beside its answers."""

OTHERS = [pytest.param(name, marks=pytest.mark.all_models) for name in sorted(KINDS - {*REPRESENTATIVE})]
"""One of each kind: the variables and the dependencies of two models of a kind differ by names and numbers."""


@pytest.fixture(scope="session")
def jars() -> Path:
    """The folder of the jars, filled once a machine."""
    if shutil.which("java") is None or shutil.which("mvn") is None:
        pytest.skip("java and mvn are needed to fetch and run the FMI VDM checker")
    names = [f"{name}.jar" for _, name, _ in ARTIFACTS]
    if not all((CACHE / name).exists() for name in names):
        CACHE.mkdir(parents=True, exist_ok=True)
        needed = "".join(f"<dependency>{COORDINATES.format(*jar)}{ALONE}</dependency>" for jar in ARTIFACTS)
        (CACHE / "pom.xml").write_text(PROJECT.format(COORDINATES.format("lag2fmu", "jars", "1"), needed), "utf-8")
        command = ["mvn", "-q", "-B", COPY, "-Dmdep.stripVersion=true", f"-DoutputDirectory={CACHE}"]
        done = subprocess.run(command, cwd=CACHE, capture_output=True, text=True, timeout=300, check=False)
        if done.returncode:
            pytest.skip(f"Maven could not fetch the FMI VDM checker: {done.stdout[-300:]}")
    return CACHE


class Checker:
    """One of the checker's models, in a folder with all jars; of two models the checker would take the rule model.

    ``findings`` asks an interpreter that goes on from FMU to FMU, with the files and the question of the command.
    """

    def __init__(self, folder: Path, model: str, jars: Path) -> None:
        self._folder, self._model = folder, f"fmi2-{model}"
        for jar in jars.glob("*.jar"):
            shutil.copy(jar, folder / jar.name)
        for name in ("vdmcheck2.jar", f"{model}.jar"):
            with zipfile.ZipFile(jars / name) as archive:
                archive.extractall(folder, [n for n in archive.namelist() if n.startswith(("fmi2schema/", "fmi2-"))])
        rules = sorted(folder.glob(f"{self._model}/Rules/*.adoc"))
        self._files = [self._model, *(str(rule.relative_to(folder)) for rule in rules)]
        self._interpreter: subprocess.Popen[bytes] | None = None

    def command(self, fmu: Path) -> str:
        """What the checker's command says of ``fmu``, nothing if it found no errors."""
        line = ["java", "-jar", "vdmcheck2.jar", str(fmu)]
        done = subprocess.run(line, cwd=self._folder, capture_output=True, text=True, timeout=LONGEST, check=False)
        said = (done.stdout + done.stderr).strip()
        return "" if said == "No errors found." and done.returncode == 0 else said or f"exit code {done.returncode}"

    def findings(self, fmu: Path) -> str:
        """Nothing if its interpreter says that ``fmu`` is valid and no more; else what the command says of it."""
        if self._interpreter is None:
            line = [*BOUNDED, "java", *QUICK_START, *PROPERTIES, "-cp", CLASSES, "com.fujitsu.vdmj.VDMJ"]
            line += ["-vdmsl", "-q", "-annotations", "-i", *self._files, str(fmu)]
            pipe = subprocess.PIPE
            self._interpreter = subprocess.Popen(
                line, cwd=self._folder, bufsize=0, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT
            )
            self._heard(self._interpreter)
        said = "".join(
            self._heard(self._interpreter, command)
            for command in (f"load {' '.join([*self._files, str(fmu)])}", f"print {QUESTION}")
        )
        told = [line for line in said.splitlines() if line and not ASIDE.match(line)]
        return "" if told == ["= true"] else self.command(fmu)

    def _heard(self, interpreter: subprocess.Popen[bytes], command: str | None = None) -> str:
        """What the interpreter says to ``command``, before it asks for the next one.

        What stood in the pipe while something is computed would be taken for the key that interrupts it.
        """
        to, out = interpreter.stdin, interpreter.stdout
        assert to is not None
        assert out is not None
        watch = Timer(LONGEST, interpreter.kill)
        watch.start()
        try:
            if command is not None:
                to.write(f"{command}\n".encode())
            said = b"\n"
            while not said.endswith(b"\n> "):
                letter = out.read(1)
                assert letter, f"the interpreter has ended: {said.decode()}"
                said += letter
        finally:
            watch.cancel()
        return said.removesuffix(b"> ").decode()

    def end(self) -> None:
        """Let the interpreter go."""
        if self._interpreter is not None:
            self._interpreter.communicate(b"quit\n", timeout=LONGEST)


@pytest.fixture(scope="session", params=["rule-model", "static-model"])
def checker(request, jars: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Checker]:
    """The checker with one of its models."""
    found = Checker(tmp_path_factory.mktemp(request.param), request.param, jars)
    yield found
    found.end()


@pytest.mark.parametrize("model", [*REPRESENTATIVE, *OTHERS])
def test_nothing_is_found(model: str, checker: Checker, exported) -> None:
    assert checker.findings(exported(representative(model)).path) == ""


@pytest.fixture(scope="module")
def fullest(tmp_path_factory: pytest.TempPathFactory) -> Fmu:
    """All outputs promoted, with a reference trajectory inside."""
    from lag2fmu.verify.reference_files import reference_files

    mechanism, path = load("double_pendulum"), tmp_path_factory.mktemp("fullest") / "full.fmu"
    return export(mechanism, path, outputs=("all",), extra=reference_files(mechanism))


def test_nothing_is_found_in_the_fullest_fmu(checker: Checker, fullest: Fmu) -> None:
    """Nor when the checker is called as its users call it."""
    assert checker.findings(fullest.path) == checker.command(fullest.path) == ""


def test_nothing_is_found_in_an_fmu_of_the_python_backend(checker: Checker, tmp_path: Path) -> None:
    fmu = export(load("double_pendulum"), tmp_path / "python.fmu", backend="python", outputs=("kinetic_energy",))
    assert checker.findings(fmu.path) == ""


def test_a_fault_is_found(checker: Checker, exported, tmp_path: Path) -> None:
    """So that silence means something: a stop time before the start time, which both models know."""
    fmu: Fmu = exported("pendulum")
    broken = tmp_path / "broken.fmu"
    with zipfile.ZipFile(fmu.path) as archive, zipfile.ZipFile(broken, "w") as target:
        for name in archive.namelist():
            data = archive.read(name)
            if name == "modelDescription.xml":
                data = re.sub(rb'stopTime="[^"]*"', b'stopTime="-1.0"', data)
            target.writestr(name, data)
    found = checker.findings(broken)
    assert "stopTime" in found or "stop time" in found
    assert checker.findings(fmu.path) == "", "the next one is another one"

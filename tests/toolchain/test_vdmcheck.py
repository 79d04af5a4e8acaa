"""The FMI VDM checker, a formal model of the standard (Battle et al., INTO-CPS): no finding in both of its models.

Its jars come from Maven Central into a cache outside of the repository; they are called, never shipped (GPL).
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import zipfile
from pathlib import Path

import pytest
from hosts import REPRESENTATIVE, representative

from lag2fmu.fmu import Fmu, export
from lag2fmu.formats.loading import bundled, load

pytestmark = pytest.mark.toolchain

ARTIFACTS = {
    "org.into-cps.vdmcheck.fmi2:vdmcheck2:1.1.3": "vdmcheck2.jar",
    "org.into-cps.vdmcheck.fmi2:rule-model:1.1.3": "rule-model.jar",
    "org.into-cps.vdmcheck.fmi2:static-model:1.1.3": "static-model.jar",
    "org.into-cps.vdmcheck:xsd2vdm:1.1.3": "xsd2vdm.jar",
    "org.into-cps.vdmcheck:fmuReader:1.1.3": "fmuReader.jar",
    "dk.au.ece.vdmj:vdmj:4.5.0": "vdmj.jar",
    "dk.au.ece.vdmj:annotations:4.5.0": "annotations.jar",
}
"""Maven coordinates -> the names that the checker expects beside itself."""
COPY = "org.apache.maven.plugins:maven-dependency-plugin:3.6.1:copy"
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "lag2fmu-tests" / "vdmcheck-1.1.3"

OTHERS = [pytest.param(name, marks=pytest.mark.all_models) for name in bundled() if name not in REPRESENTATIVE]


@pytest.fixture(scope="session")
def jars() -> Path:
    """The folder of the jars, filled once a machine."""
    if shutil.which("java") is None or shutil.which("mvn") is None:
        pytest.skip("java and mvn are needed to fetch and run the FMI VDM checker")
    CACHE.mkdir(parents=True, exist_ok=True)
    for artifact, name in ARTIFACTS.items():
        if (CACHE / name).exists():
            continue
        folder = CACHE / artifact.split(":")[1]
        command = ["mvn", "-q", "-B", COPY, f"-Dartifact={artifact}", f"-DoutputDirectory={folder}"]
        done = subprocess.run(command, cwd=CACHE, capture_output=True, text=True, timeout=300, check=False)
        if done.returncode:
            pytest.skip(f"Maven could not fetch {artifact}: {done.stdout[-300:]}")
        (jar,) = folder.glob("*.jar")
        jar.replace(CACHE / name)
    return CACHE


@pytest.fixture(scope="session", params=["rule-model", "static-model"])
def checker(request, jars: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the checker and one of its models; it takes the rule model where it finds one."""
    folder = tmp_path_factory.mktemp(request.param)
    for name in ARTIFACTS.values():
        shutil.copy(jars / name, folder / name)
    for name in ("vdmcheck2.jar", f"{request.param}.jar"):
        with zipfile.ZipFile(jars / name) as archive:
            archive.extractall(folder, [n for n in archive.namelist() if n.startswith(("fmi2schema/", "fmi2-"))])
    return folder


def findings(checker: Path, fmu: Path) -> str:
    """What the checker says of ``fmu``, nothing if it found no errors."""
    done = subprocess.run(
        ["java", "-jar", "vdmcheck2.jar", str(fmu)],
        cwd=checker,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    said = (done.stdout + done.stderr).strip()
    return "" if said == "No errors found." and done.returncode == 0 else said or f"exit code {done.returncode}"


@pytest.mark.parametrize("model", [*REPRESENTATIVE, *OTHERS])
def test_nothing_is_found(model: str, checker: Path, exported) -> None:
    assert findings(checker, exported(representative(model)).path) == ""


@pytest.fixture(scope="module")
def fullest(tmp_path_factory: pytest.TempPathFactory) -> Fmu:
    """All outputs promoted, with a reference trajectory inside."""
    from lag2fmu.verify.reference_files import reference_files

    mechanism, path = load("double_pendulum"), tmp_path_factory.mktemp("fullest") / "full.fmu"
    return export(mechanism, path, outputs=("all",), extra=reference_files(mechanism))


def test_nothing_is_found_in_the_fullest_fmu(checker: Path, fullest: Fmu) -> None:
    assert findings(checker, fullest.path) == ""


def test_nothing_is_found_in_an_fmu_of_the_python_backend(checker: Path, tmp_path: Path) -> None:
    fmu = export(load("double_pendulum"), tmp_path / "python.fmu", backend="python", outputs=("kinetic_energy",))
    assert findings(checker, fmu.path) == ""


def test_a_fault_is_found(checker: Path, exported, tmp_path: Path) -> None:
    """So that silence means something: a stop time before the start time, which both models know."""
    fmu: Fmu = exported("pendulum")
    broken = tmp_path / "broken.fmu"
    with zipfile.ZipFile(fmu.path) as archive, zipfile.ZipFile(broken, "w") as target:
        for name in archive.namelist():
            data = archive.read(name)
            if name == "modelDescription.xml":
                data = re.sub(rb'stopTime="[^"]*"', b'stopTime="-1.0"', data)
            target.writestr(name, data)
    assert "stopTime" in findings(checker, broken) or "stop time" in findings(checker, broken)

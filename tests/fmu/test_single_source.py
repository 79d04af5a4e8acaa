"""The C code of an FMU in a single file: compilers have nothing to say, and it moves as the many files do."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import pytest
from compiling import COMPILERS, QUICK, TARGET, UNOPTIMISED
from delivered import before_joining, unpack_sources
from fmpy.model_description import read_build_description
from headers import headers_of_fmi
from stepping import Stepping
from stepping3 import Stepping3

from lag2fmu.checking.schema import problems
from lag2fmu.codegen.amalgamation import amalgamated
from lag2fmu.codegen.c import c_string
from lag2fmu.codegen.tokens import words
from lag2fmu.errors import ExportError
from lag2fmu.fmu import Fmu, export
from lag2fmu.fmu.materials import BILL_ENTRY
from lag2fmu.fmu.sources import ALL, FORMS, MANY, SINGLE, source_files
from lag2fmu.fmu.versions import VERSIONS

pytestmark = pytest.mark.fmu

STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Werror", "-ffp-contract=off"]
HERE = Path(__file__).parent
BUILD = "sources/buildDescription.xml"
C = (*QUICK, *STRICT, *UNOPTIMISED["zig"])
CPLUSPLUS = {"zig": [sys.executable, "-m", "ziglang", "c++", *TARGET, "-Wno-c99-designator"]}
if shutil.which("g++"):
    CPLUSPLUS["gcc"] = ["g++"]
OF_CPLUSPLUS = ["-x", "c++", "-std=c++20", "-Wall", "-Wextra", "-Werror", "-Wno-missing-field-initializers"]
"""Fields without initializers are zeros, which is meant."""
CASES = [
    ("double_pendulum", "2.0", "dopri5"),
    ("double_pendulum", "3.0", "dopri5"),
    ("four_bar_linkage", "2.0", "dopri5"),
    ("four_bar_linkage", "3.0", "radau5"),
    ("woodpecker", "2.0", "moreau"),
    ("woodpecker", "3.0", "dopri5"),
]
RESERVED = re.compile(r"__|_[A-Z]")
"""C99, section 7.1.3: what no program declares."""
OF_COMPILERS = {"__GNUC__", "__attribute__", "__STDC_VERSION__", "__cplusplus"}


@cache
def files_of(model: str, fmi: str, solver: str, form: str) -> dict[str, str]:
    """{file in sources/: text}, without compiling."""
    identifier, sources = before_joining(model, fmi, solver)
    files = source_files(sources, identifier, VERSIONS[fmi].gate, form)
    return {name.removeprefix("sources/"): content.decode() for name, content in files.items()}


# ---------------------------------------------------------------------------------------------------------- its text


@pytest.mark.parametrize(("model", "fmi", "solver"), CASES)
def test_names_are_the_programs_own(model: str, fmi: str, solver: str) -> None:
    """None that C reserves, none longer than the 63 characters that compilers distinguish; FMI's headers alone."""
    code = files_of(model, fmi, solver, SINGLE)[ALL]
    assert set(re.findall(r'^#include "(.*)"', code, re.MULTILINE)) == {VERSIONS[fmi].header}
    used = set(words(code))
    assert {word for word in used if RESERVED.match(word)} <= OF_COMPILERS
    assert max(map(len, used)) <= 63
    static = set(re.findall(r"^static [^;{}=()]*?(\w+)\(", code, re.MULTILINE))
    assert len(static) > 100
    assert not {name for name in static if re.match(r"(str|mem|wcs)[a-z]", name)}, "string.h reserves them"


@pytest.mark.parametrize(("model", "fmi", "solver"), CASES)
def test_files_have_names_for_each_file_system(model: str, fmi: str, solver: str) -> None:
    """None differs from another by case only, none is longer than 63 characters."""
    names = files_of(model, fmi, solver, MANY)
    assert set(files_of(model, fmi, solver, SINGLE)) == {ALL, "buildDescription.xml"} < set(names)
    assert len({name.casefold() for name in names}) == len(names)
    assert max(map(len, names)) <= 63


def test_an_export_has_the_one_file(tmp_path: Path) -> None:
    """It is declared in both places, and the library is that of the many files; the bill lists the sources."""
    fmus = [export("cart_pole", tmp_path / f"{form}.fmu", sources=form, page="static") for form in FORMS]
    many, single = (zipfile.ZipFile(fmu.path) for fmu in fmus)
    with many, single:
        names = set(single.namelist())
        assert {name for name in names if name.startswith("sources/")} == {f"sources/{ALL}", BUILD}
        common = sorted(names & set(many.namelist()) - {f"sources/{ALL}", BILL_ENTRY})
        assert len(names) == len(common) + 2
        assert [many.read(name) for name in common] == [single.read(name) for name in common]
    (configuration,) = read_build_description(str(fmus[1].path))
    assert configuration.sourceFileSets[0].sourceFiles == [ALL]
    assert problems(fmus[1].path) == []


def test_inline_functions_that_nothing_calls_are_left_out() -> None:
    """Those too that only such a one calls; a name in a comment is no call."""
    header = (
        "/* Three. */\nstatic inline int three(void) { return 3; }\n"
        "/* Calls three. */\nstatic inline int idle(int n) {\n    return n + three();\n}\n"
        "static inline int\nfour(void) { return 4; }\n"
    )
    code = amalgamated({"a.h": header, "a.c": '#include "a.h"\nint f(void) { return four(); }\n'})
    assert set(words(code)) == {"static", "inline", "int", "four", "void", "return", "f"}
    assert "Three" not in code


# ------------------------------------------------------------------------------------------------------ what it takes


def test_words_that_do_not_fit(tmp_path: Path) -> None:
    path = tmp_path / "it.fmu"
    with pytest.raises(ExportError, match="--sources one: known are many, single"):
        export("cart_pole", path, sources="one")
    with pytest.raises(ExportError, match="'python' has no C code"):
        export("cart_pole", path, sources="single", backend="python")
    with pytest.raises(ExportError, match="--without sources leaves the C code out"):
        export("cart_pole", path, sources="single", without=("sources",))
    assert not path.exists()


# ---------------------------------------------------------------------------------------------------------- compiled


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize(("model", "fmi", "solver"), CASES)
def test_compilers_have_nothing_to_say(model: str, fmi: str, solver: str, compiler: str, tmp_path: Path) -> None:
    (tmp_path / ALL).write_text(files_of(model, fmi, solver, SINGLE)[ALL], "utf-8")
    # clang finds what it warns of before it optimises, gcc on the way
    command = [*COMPILERS[compiler], *STRICT, *(UNOPTIMISED["zig"] if compiler == "zig" else ["-O1"])]
    run(*command, "-isystem", headers_of_fmi(tmp_path), "-c", tmp_path / ALL, "-o", tmp_path / "all.o")


LINKED = [
    ("double_pendulum", "2.0", ""),
    ("cart_pole", "2.0", ""),
    ("cart_pole", "2.0", "other_"),
    ("cart_pole", "3.0", "third_"),
]
"""Model, version of FMI, and a prefix where the default one would come twice."""


@pytest.mark.parametrize("compiler", CPLUSPLUS)
@pytest.mark.parametrize(("model", "fmi", "solver"), CASES)
def test_it_is_cpp_as_well(model: str, fmi: str, solver: str, compiler: str, tmp_path: Path) -> None:
    (tmp_path / ALL).write_text(files_of(model, fmi, solver, SINGLE)[ALL], "utf-8")
    # zig takes no -c beside -fsyntax-only, and would link
    command = [*CPLUSPLUS[compiler], *OF_CPLUSPLUS, "-O0" if compiler == "zig" else "-fsyntax-only"]
    run(*command, "-isystem", headers_of_fmi(tmp_path), "-c", tmp_path / ALL, "-o", tmp_path / "all.o")


@pytest.mark.parametrize(
    ("form", "command"),
    [(MANY, C), (SINGLE, C), (SINGLE, (*CPLUSPLUS["zig"], *OF_CPLUSPLUS, *UNOPTIMISED["zig"], "-ffp-contract=off"))],
    ids=["many", "single", "cpp"],
)
def test_fmus_in_one_program(exported, form: str, command: Sequence[str], tmp_path: Path) -> None:
    """Linked without hiding a symbol; each moves as its own library does."""
    headers, runs, objects, expected = headers_of_fmi(tmp_path), [], [], []
    for number, (model, fmi, prefix) in enumerate(LINKED):
        fmu = exported(model, fmi=fmi)
        file = delivered(fmu, model, fmi, form, tmp_path / str(number))
        objects.append(tmp_path / f"{number}.o")
        own = [f"-DFMI{fmi[0]}_FUNCTION_PREFIX={prefix}"] if prefix else []
        run(*command, *own, "-isystem", headers, "-c", file, "-o", objects[-1])
        runs.append(f"RUN_FMI{fmi[0]}({prefix or f'{model}_'}, {c_string(fmu.description.guid)}, 4)")
        expected.append(alone(fmu.path, fmi))
    main = "\n    ".join(["int main(void) {", *runs, "return 0;\n}\n"])
    (tmp_path / "main.c").write_text(f'#include "linked_fmus.h"\n\n{main}', "utf-8")
    includes = [f"-I{HERE}", "-isystem", headers]
    run(*C, *includes, tmp_path / "main.c", *objects, "-lm", "-o", tmp_path / "program")
    found = [[float(number) for number in line.split()] for line in run(tmp_path / "program").splitlines()]
    assert [len(row) for row in found] == [4] * len(LINKED)
    for one, other in zip(found, expected, strict=True):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-9)
    assert len({tuple(row) for row in expected}) > 1


def alone(path: Path, fmi: str) -> list[float]:
    """The four states after 20 steps of 0.1 s."""
    if fmi == "2.0":
        with Stepping(path) as host:
            return host.start().steps(20, 0.1)[-1]
    with Stepping3(path) as host:
        states = [name for name, reference in host.references.items() if 1 <= reference <= 4]
        return host.start().run([0.1 * i for i in range(21)], states)[0][-1]


def delivered(fmu: Fmu, model: str, fmi: str, form: str, folder: Path) -> Path:
    """The file to compile, beside what it includes, of the C code of ``fmu`` of ``model`` in this form."""
    if form == MANY:
        return unpack_sources(fmu, folder)
    folder.mkdir()
    path = folder / ALL
    path.write_text(files_of(model, fmi, "dopri5", SINGLE)[ALL], "utf-8")
    return path


def run(*command: object) -> str:
    """What ``command`` prints; an AssertionError with its complaints where it has any."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout

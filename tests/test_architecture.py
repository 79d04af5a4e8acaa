"""The rooms of DESIGN section 2: who may import whom, and which third-party packages each room may use."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import lag2fmu
from lag2fmu import errors

PACKAGE = Path(lag2fmu.__file__).parent

ROOMS = {
    "language": ({"errors"}, {"sympy"}),
    "description": ({"errors", "language"}, {"sympy"}),
    "mechanism": ({"errors", "lazy", "language", "description"}, {"sympy", "typing_extensions"}),
    "formats": (
        {"errors", "mesh_files", "resources", "xml_tree", "language", "description", "mechanism"},
        {"sympy", "numpy", "tomli", "mujoco"},
    ),
    "building": ({"errors", "progress", "version"}, {"platformdirs"}),
    "reference": (
        {"deadline", "errors", "lazy", "writing", "building", "language", "description", "mechanism"},
        {"sympy", "numpy", "scipy"},
    ),
    "graph": ({"errors", "language"}, {"sympy", "numpy"}),
    "dynamics": (
        {"errors", "lazy", "language", "description", "mechanism", "formats", "graph"},
        {"sympy", "numpy", "scipy"},
    ),
    "analysis": (
        {"deadline", "errors", "progress", "language", "description", "mechanism", "formats", "graph", "dynamics"}
        | {"writing"},
        {"sympy", "numpy", "scipy", "control"},
    ),
    "picture": (
        {"errors", "mesh_files", "language", "description", "mechanism", "graph", "dynamics"},
        {"sympy", "numpy", "trimesh", "fast_simplification"},
    ),
    "procedure": (
        {"language", "description", "mechanism", "reference", "graph", "dynamics"},
        {"sympy", "numpy"},
    ),
    "solvers": (set(), set()),
    "codegen": ({"building", "resources", "graph", "dynamics", "solvers"}, {"jinja2"}),
    "fmu": (
        {"archives", "errors", "progress", "lazy", "building", "resources", "version", "xml_tree", "language"}
        | {
            "writing",
            "description",
            "mechanism",
            "formats",
            "dynamics",
            "analysis",
            "graph",
            "picture",
            "procedure",
            "solvers",
            "codegen",
        },
        {"numpy", "rjsmin"},
    ),
    "ensemble": (
        {"errors", "lazy", "description", "mechanism", "formats", "dynamics", "solvers", "codegen", "fmu"},
        {"numpy"},
    ),
    "checking": ({"archives", "errors", "lazy", "xml_tree"}, {"fmpy", "lief", "lxml", "minisign", "rich"}),
    "verify": (
        {
            "deadline",
            "errors",
            "lazy",
            "progress",
            "xml_tree",
            "language",
            "description",
            "mechanism",
            "formats",
            "reference",
            "graph",
            "dynamics",
        }
        | {"archives", "writing", "analysis", "picture", "solvers", "fmu", "checking"},
        {"sympy", "numpy", "fmpy", "lxml", "rich", "matplotlib"},
    ),
    "evidence": (
        {"deadline", "errors", "building", "version", "mechanism", "formats", "reference", "solvers", "fmu", "verify"}
        | {"checking"},
        {"numpy", "fmpy", "casadi", "libcosimpy"},
    ),
    "systems": (
        {"errors", "progress", "xml_tree", "version", "language", "description", "mechanism", "formats", "reference"}
        | {"archives", "fmu", "verify", "checking"},
        {"numpy"},
    ),
    "studies": (
        {
            "errors",
            "progress",
            "version",
            "language",
            "description",
            "mechanism",
            "formats",
            "reference",
            "graph",
            "dynamics",
            "analysis",
            "solvers",
            "codegen",
        }
        | {"fmu", "ensemble", "verify", "systems", "writing"},
        {"numpy", "scipy", "xarray", "pyarrow", "matplotlib"},
    ),
    "cli": (
        {
            "deadline",
            "errors",
            "progress",
            "resources",
            "version",
            "language",
            "description",
            "mechanism",
            "formats",
            "reference",
            "dynamics",
        }
        | {"analysis", "procedure", "solvers", "building", "fmu", "verify", "studies", "checking", "evidence"}
        | {"systems", "writing"},
        {"click", "rich"},
    ),
}
"""room -> (rooms it may import beside itself, third-party packages); each room stands below those that it may import"""

SINGLE = (
    "archives",
    "deadline",
    "errors",
    "lazy",
    "mesh_files",
    "progress",
    "resources",
    "version",
    "writing",
    "xml_tree",
)
"""The modules beside the rooms, for every room."""

USERS = {
    "jinja2": {"codegen/templates.py"},
    "platformdirs": {"building/folders.py"},
    "subprocess": {"building/process.py", "building/supervisor.py", "checking/process.py"},
    "zipfile": {"archives.py"},
    "casadi": {"evidence/importers.py"},
    "libcosimpy": {"evidence/importers.py"},
    "fmpy": {
        "checking/schema.py",
        "evidence/checks.py",
        "verify/instances.py",
        "verify/by_fmpy.py",
        "verify/hosted.py",
        "verify/simulate.py",
    },
    "lief": {"checking/binaries.py"},
    "lxml": {"checking/schema.py"},
    "minisign": {"checking/signature.py"},
    "matplotlib": {"verify/plots", "studies/calibration_figure.py", "studies/estimates_figure.py"},
    "mujoco": {"formats/robots/mjcf.py"},
    "collada": {"mesh_files.py"},
    "trimesh": {"picture/surfaces.py"},
    "fast_simplification": {"picture/surfaces.py"},
}
"""package -> the modules or rooms that use it: one each, but compilers and strangers' FMUs are different programs"""

MOST_LAYERS = 25
"""Modules in the longest chain of imports, from ``errors`` to ``__main__``; imports inside functions count.

A Mechanism is complete when it is built, so that ten of them stand before whatever reads one.
"""

MOST_LINES, MOST_LONG_MODULES = 300, 0
"""Lines that a module should fit in, and how many modules may be longer; none has half as many again."""

MOST_LINES_OF_A_FUNCTION = 50
"""Without its docstring; 50 are what a screen takes in at once."""

MOST_WAYS = 12
"""Branches that a function may have."""


def _modules() -> list[Path]:
    return sorted(path.relative_to(PACKAGE) for path in PACKAGE.rglob("*.py"))


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse((PACKAGE / path).read_text("utf-8"))


@cache
def _nodes(path: Path) -> list[ast.AST]:
    """All nodes of a module's tree; to walk it for each test takes most of their time."""
    return list(ast.walk(_tree(path)))


@cache
def _is_module(name: str) -> bool:
    place = PACKAGE.parent.joinpath(*name.split("."))
    return place.is_dir() or place.with_suffix(".py").is_file()


@cache
def _imports(path: Path, *, typing_too: bool = True) -> set[str]:
    """The dotted names a module imports; imports for type checking only can be left out."""
    skipped = set()
    for node in () if typing_too else _nodes(path):
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            skipped |= {id(inner) for inner in ast.walk(node)}
    found: set[str] = set()
    for node in _nodes(path):
        if id(node) in skipped:
            continue
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                found.add(full if _is_module(full) else str(node.module))
    return found


def test_a_module_imports_only_what_its_room_may() -> None:
    for path in (p for p in _modules() if p.parts[0] in ROOMS):
        rooms, packages = ROOMS[path.parts[0]]
        for name in _imports(path):
            top, *rest = name.split(".")
            if top == "lag2fmu" and rest:
                assert rest[0] in rooms | {path.parts[0]}, f"{path} imports {name}"
            elif top != "lag2fmu" and top not in sys.stdlib_module_names:
                assert top in packages, f"{path} imports {name}"


def test_a_room_imports_only_rooms_above_it() -> None:
    order = list(ROOMS)
    for room, (others, _) in ROOMS.items():
        above = order[: order.index(room)]
        assert others <= {*above, *SINGLE}, room


def test_every_module_belongs_to_a_room() -> None:
    top_level = {p.parts[0] for p in _modules()}
    assert top_level == {*ROOMS, "__init__.py", "__main__.py", *(f"{name}.py" for name in SINGLE)}


@pytest.mark.parametrize(("package", "expected"), USERS.items())
def test_a_package_has_its_users_only(package: str, expected: set[str]) -> None:
    users = {p for p in _modules() if any(n.split(".")[0] == package for n in _imports(p, typing_too=False))}
    rooms = {p.parent.as_posix() if p.parent.as_posix() in expected else p.as_posix() for p in users}
    assert rooms == expected


def _name(path: Path) -> str:
    return ".".join(("lag2fmu", *path.with_suffix("").parts)).removesuffix(".__init__")


def test_there_are_few_import_layers_and_no_cycles() -> None:
    """Imports for types and those inside functions count; the names that ``lag2fmu`` offers are read when asked for."""
    graph = {_name(path): _imports(path, typing_too=path.name != "__init__.py") for path in _modules()}
    graph = {name: {n for n in imports if n in graph and n != name} for name, imports in graph.items()}
    layers = 0
    while graph:
        leaves = [name for name, imports in graph.items() if not imports & graph.keys()]
        assert leaves, f"a cycle among {sorted(graph)}"
        for leaf in leaves:
            del graph[leaf]
        layers += 1
    assert layers <= MOST_LAYERS


def _homes(path: Path) -> dict[str, str]:
    """Name that a module has from another one of the package -> that module."""
    found = [node for node in _nodes(path) if isinstance(node, ast.ImportFrom)]
    return {a.name: str(n.module) for n in found for a in n.names if str(n.module).startswith("lag2fmu.")}


def test_a_name_comes_from_the_module_that_defines_it() -> None:
    """What a room's ``__init__`` offers is for those outside: users, models, tests."""
    doors = {_name(path): _homes(path) for path in _modules() if path.name == "__init__.py"}
    for path in _modules():
        for node in (n for n in _nodes(path) if isinstance(n, ast.ImportFrom) and path.name != "__init__.py"):
            for alias in node.names:
                home = doors.get(str(node.module), {}).get(alias.name)
                assert home is None, f"{path}: import {alias.name} from {home}, not from {node.module}"


def test_a_class_has_a_name_of_its_own() -> None:
    """One word is one thing, in all rooms and in private."""
    classes = [node.name for path in _modules() for node in _nodes(path) if isinstance(node, ast.ClassDef)]
    assert len(classes) > 300
    assert [name for name, times in Counter(classes).items() if times > 1] == []


def test_the_public_names_are_these() -> None:
    assert sorted(lag2fmu.__all__) == [
        "Ensemble",
        "Lag2FmuError",
        "Mechanism",
        "calibrate",
        "derive",
        "equilibria",
        "export",
        "function",
        "gradient",
        "linearize",
        "load",
        "modes",
        "observe",
        "page",
        "sensitivities",
        "simulate",
        "ssp",
        "start",
        "sweep",
        "validate",
    ]
    for name in (*lag2fmu.__all__, "__version__"):
        assert getattr(lag2fmu, name) is not None
        assert name in dir(lag2fmu)


def test_other_names_list_those_that_there_are() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'exprot'; there are .*export"):
        getattr(lag2fmu, "exprot")  # noqa: B009 (an attribute that is not there is no code)


def test_the_process_that_runs_an_fmu_imports_nothing_heavy() -> None:
    """It is started once more after each crash, and a stranger's library shares its memory."""
    heavy = ["sympy", "numpy", "fmpy", "scipy", "matplotlib", "lief"]
    code = f"import lag2fmu.checking.child, sys; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


@pytest.mark.parametrize("arguments", [["--help"], ["models"], ["new", "cart"]], ids=lambda x: x[0])
def test_what_needs_no_algebra_imports_nothing_heavy(arguments: list[str], tmp_path: Path) -> None:
    """These commands are there at once: SymPy alone takes a third of a second."""
    heavy = ["sympy", "numpy", "fmpy", "scipy", "matplotlib"]
    code = (
        "import sys; from lag2fmu.cli import main; "
        f"main({arguments}, standalone_mode=False); print([m for m in {heavy} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert done.stdout.endswith("[]\n")


UNREAD = (
    *("scipy", "fmpy", "matplotlib", "rich", "multiprocessing", "numpy.random", "tomllib", "tomli", "lag2fmu.verify"),
    *("lag2fmu.formats.robots.tree", "lag2fmu.formats.text", "lag2fmu.xml_tree", "lag2fmu.mesh_files"),
    *("lag2fmu.analysis.at_rest", "lag2fmu.analysis.inverse", "lag2fmu.analysis.observation"),
    *("lag2fmu.analysis.observing", "lag2fmu.analysis.present_modes", "lag2fmu.cli.noise"),
    *("lag2fmu.dynamics.row_tables", "lag2fmu.dynamics.schur_complement", "lag2fmu.dynamics.sparse_rows"),
    *("lag2fmu.graph.interpolants", "lag2fmu.picture.pulleys", "lag2fmu.fmu.ports", "lag2fmu.fmu.taken"),
    *("lag2fmu.fmu.footprint", "lag2fmu.fmu.live.samples", "lag2fmu.fmu.wasm.component", "lag2fmu.fmu.wasm.wit"),
)
"""What an export of a mechanism without contacts, constraints, tables and meshes calls no function of.

Such modules are imported where they are used, and for types under TYPE_CHECKING. Each takes 0.3 to 2 ms, for the
methods that dataclasses write and for patterns; those of others take as long as SymPy.
"""

OF_OTHER_BACKENDS = ("importlib.metadata", "email")
"""What only the python backend reads, to find PythonFMU."""


def test_an_export_reads_no_module_that_it_does_not_use(tmp_path: Path) -> None:
    """To read what was not used took a tenth of the time of a small export."""
    assert [name for name in UNREAD if name.startswith("lag2fmu.") and not _is_module(name)] == []
    code = (
        "import sys, lag2fmu.cli.exporting; from lag2fmu.cli import main; "
        f"before = [m for m in {OF_OTHER_BACKENDS} if m in sys.modules]; "
        "main(['export', 'double_pendulum', '--backend', 'python'], standalone_mode=False); "
        f"print(before + [m for m in {UNREAD} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert done.stdout.endswith("[]\n")


def test_no_tracked_file_is_binary_but_those_listed() -> None:
    """What a compiler or a tool makes is made anew, not kept."""
    root = PACKAGE.parent
    if not (root / ".git").exists():
        pytest.skip("this is no checkout")
    done = subprocess.run(["git", "ls-files", "-z"], cwd=root, capture_output=True, text=True, check=True)
    files = [root / name for name in done.stdout.split("\0") if name]
    binary = {p.relative_to(root).as_posix() for p in files if p.is_file() and b"\0" in p.read_bytes()[:8192]}
    assert binary == {"templates/documentation/model.png"}


BRANCHES = (ast.If, ast.For, ast.While, ast.IfExp, ast.ExceptHandler, ast.BoolOp, ast.comprehension, ast.Assert)


def test_modules_and_functions_are_read_at_a_glance() -> None:
    """Functions fit a screen with their docstrings; few branch often, and few modules are long."""
    lines = {path.as_posix(): (PACKAGE / path).read_text("utf-8").count("\n") for path in _modules()}
    long = {name: count for name, count in lines.items() if count > MOST_LINES}
    assert len(long) <= MOST_LONG_MODULES, long
    assert max(long.values(), default=0) <= 1.5 * MOST_LINES, long
    wide = {}
    for name in lines:
        for node in (n for n in _nodes(Path(name)) if isinstance(n, ast.FunctionDef)):
            ways = 1 + sum(isinstance(inner, BRANCHES) for inner in ast.walk(node))
            wide |= {f"{name}: {node.name}": ways} if ways > MOST_WAYS else {}
            lines = (node.end_lineno or 0) - node.lineno - len((ast.get_docstring(node) or "").splitlines())
            assert lines <= MOST_LINES_OF_A_FUNCTION, f"{name}: {node.name} is longer than a screen"
    assert not wide, wide


def _public(node: ast.AST) -> Iterator[ast.FunctionDef]:
    """The functions and methods below ``node`` that others may call, with a docstring."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, (ast.ClassDef, ast.FunctionDef)) and not child.name.startswith("_"):
            if isinstance(child, ast.ClassDef):
                yield from _public(child)
            elif ast.get_docstring(child):
                yield child


OWN_ERRORS = {name for name, kind in vars(errors).items() if isinstance(kind, type)}


def _raisers(path: Path) -> set[str]:
    """The functions of a module that raise one of our errors, themselves or by another function of the module."""
    if not any(isinstance(node, ast.Raise) for node in _nodes(path)):
        return set()
    functions = [(f.name, [*ast.walk(f)]) for f in _nodes(path) if isinstance(f, ast.FunctionDef)]
    calls = {name: {_called(n) for n in nodes if isinstance(n, ast.Call)} for name, nodes in functions}
    raised = [(name, n.exc) for name, nodes in functions for n in nodes if isinstance(n, ast.Raise) and n.exc]
    found = {name for name, exc in raised if OWN_ERRORS & {x.id for x in ast.walk(exc) if isinstance(x, ast.Name)}}
    while more := {name for name, others in calls.items() if others & found} - found:
        found |= more
    return found


def _called(call: ast.Call) -> str:
    """The name of what may be a function of the same module: a plain name, or an attribute of self or cls; else ""."""
    called = call.func
    if isinstance(called, ast.Attribute):
        return called.attr if isinstance(called.value, ast.Name) and called.value.id in ("self", "cls") else ""
    return called.id if isinstance(called, ast.Name) else ""


@pytest.mark.parametrize("room", [room for room in ROOMS if room != "checking"])
def test_a_function_says_which_errors_it_raises(room: str) -> None:
    """Those of its module; errors that come from farther down are said there."""
    for path in (p for p in _modules() if p.parts[0] == room):
        raisers = _raisers(path)
        documented = {f.name for f in _public(_tree(path)) if RAISES.search(ast.get_docstring(f) or "")}
        silent = {f.name for f in _public(_tree(path))} & raisers - documented
        assert not silent, f"{path}: {silent}"


RAISES = re.compile(r"\b[Rr]aises?\b")
ARRAY = re.compile(r"(tuple\[)?(Floats|NDArray|ArrayLike)\b")
SHAPE = re.compile(r"\([^()]*,[^()]*\)|\(\*\w+\)|\bshapes?\b")


def test_a_function_says_which_shapes_its_arrays_have() -> None:
    """Such as (n,), (m, n) or (3, *batch)."""
    for path in _modules():
        for function in _public(_tree(path)):
            kinds = [a.annotation for a in (*function.args.args, *function.args.kwonlyargs)] + [function.returns]
            if any(kind is not None and ARRAY.match(ast.unparse(kind)) for kind in kinds):
                assert SHAPE.search(ast.get_docstring(function) or ""), f"{path}: {function.name}"


def test_no_test_module_is_imported_by_another_one() -> None:
    """What several tests use stands in tests/support."""
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        found = re.search(r"^\s*(?:from|import) (?:(?:\w+\.)*test_|conftest)", path.read_text("utf-8"), re.MULTILINE)
        assert found is None, f"{path}: {found[0]}"

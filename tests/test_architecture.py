"""The rooms of DESIGN section 2: who may import whom, and which third-party packages each room may use."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import lag2fmu

PACKAGE = Path(lag2fmu.__file__).parent

ROOMS = {
    "mechanism": ({"errors", "resources"}, {"sympy", "tomli", "tomllib"}),
    "reference": ({"errors", "mechanism"}, {"sympy", "numpy", "scipy"}),
    "dynamics": ({"errors", "mechanism"}, {"sympy", "numpy"}),
    "codegen": ({"errors", "resources", "dynamics"}, {"jinja2"}),
    "fmu": ({"errors", "resources", "version", "mechanism", "dynamics", "codegen"}, set()),
    "verify": (
        {"errors", "mechanism", "dynamics", "codegen", "fmu", "reference"},
        {"sympy", "numpy", "fmpy", "lief", "rich", "matplotlib"},
    ),
    "cli": (
        {"errors", "version", "mechanism", "dynamics", "codegen", "fmu", "verify", "reference"},
        {"click", "rich"},
    ),
}
"""room -> (rooms it may import beside itself, third-party packages)"""

USERS = {
    "jinja2": {"codegen/templates.py"},
    "subprocess": {"fmu/compilers.py", "reference/native.py", "verify/checking/running.py"},
    "zipfile": {"fmu/pack.py"},
    "fmpy": {"verify/instances.py", "verify/simulate.py"},
    "lief": {"verify/checking/binaries.py"},
    "matplotlib": {"verify/plots"},
}
"""package -> the modules or rooms that use it: one each, but compilers and strangers' FMUs are different programs, and
the independent path shares no compiler with what it checks"""


def _modules() -> list[Path]:
    return sorted(path.relative_to(PACKAGE) for path in PACKAGE.rglob("*.py"))


def _is_module(name: str) -> bool:
    place = PACKAGE.parent.joinpath(*name.split("."))
    return place.is_dir() or place.with_suffix(".py").is_file()


def _imports(path: Path, *, typing_too: bool = True) -> set[str]:
    """The dotted names a module imports; imports for type checking only can be left out."""
    tree = ast.parse((PACKAGE / path).read_text("utf-8"))
    skipped = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING" and not typing_too:
            skipped |= {id(inner) for inner in ast.walk(node)}
    found: set[str] = set()
    for node in ast.walk(tree):
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


@pytest.mark.parametrize("path", [p for p in _modules() if p.parts[0] in ROOMS], ids=str)
def test_a_module_imports_only_what_its_room_may(path: Path) -> None:
    room = path.parts[0]
    rooms, packages = ROOMS[room]
    for name in _imports(path):
        top, *rest = name.split(".")
        if top == "lag2fmu" and rest:
            target = rest[0]
            assert target in rooms | {room}, f"{path} imports {name}"
        elif top != "lag2fmu" and top not in sys.stdlib_module_names:
            assert top in packages, f"{path} imports {name}"


def test_every_module_belongs_to_a_room() -> None:
    top_level = {p.parts[0] for p in _modules()}
    assert top_level == {*ROOMS, "__init__.py", "errors.py", "resources.py", "version.py"}


@pytest.mark.parametrize(("package", "expected"), USERS.items())
def test_a_package_has_its_users_only(package: str, expected: set[str]) -> None:
    users = {p for p in _modules() if any(n.split(".")[0] == package for n in _imports(p, typing_too=False))}
    rooms = {p.parent.as_posix() if p.parent.as_posix() in expected else p.as_posix() for p in users}
    assert rooms == expected


def test_there_are_no_import_cycles() -> None:
    graph = {}
    for path in _modules():
        name = ".".join(("lag2fmu", *path.with_suffix("").parts)).removesuffix(".__init__")
        graph[name] = _imports(path, typing_too=False)
    graph = {name: {n for n in imports if n in graph and n != name} for name, imports in graph.items()}
    while graph:
        leaves = [name for name, imports in graph.items() if not imports & graph.keys()]
        assert leaves, f"a cycle among {sorted(graph)}"
        for leaf in leaves:
            del graph[leaf]


def test_the_public_names_are_these() -> None:
    assert sorted(lag2fmu.__all__) == [
        "Fmu",
        "Lag2FmuError",
        "Mechanism",
        "Report",
        "Trajectory",
        "__version__",
        "derive",
        "equilibria",
        "export",
        "linearize",
        "load",
        "modes",
        "simulate",
        "validate",
    ]
    for name in lag2fmu.__all__:
        assert getattr(lag2fmu, name) is not None


def test_help_imports_nothing_heavy() -> None:
    heavy = "{'sympy', 'numpy', 'fmpy', 'scipy', 'matplotlib'}"
    code = f"import sys; from lag2fmu.cli import main; print(sorted({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"

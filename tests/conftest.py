"""What several tests share: exported FMUs, one build a session and model."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from building import compiled_once

from lag2fmu.codegen import DEFAULT_SOLVER
from lag2fmu.fmu import Fmu, export
from lag2fmu.fmu.compilers import compile_libraries
from lag2fmu.formats.loading import load
from lag2fmu.mechanism import Mechanism

Exported = Callable[..., Fmu]


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--update``: write the golden files of tests/codegen anew; ``--all-models``: run what is left out else."""
    parser.addoption("--update", action="store_true", help="write golden files anew; read the diff before you commit")
    parser.addoption("--all-models", action="store_true", help="what takes minutes with every model ('make test-all')")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Without ``--all-models`` leave out the tests with the marker all_models."""
    if not config.getoption("--all-models"):
        left_out = [item for item in items if item.get_closest_marker("all_models")]
        items[:] = [item for item in items if item not in left_out]
        config.hook.pytest_deselected(items=left_out)


@pytest.fixture(scope="session", autouse=True)
def _compiled_once(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """``export`` compiles the same sources once a run, also where pytest-xdist runs it in several processes."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "libraries"
    folder.mkdir(exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("lag2fmu.fmu.exporting.compile_libraries", compiled_once(folder))
        yield


@pytest.fixture
def compiled_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests of what the compiler makes: ``export`` compiles, whatever was compiled before."""
    monkeypatch.setattr("lag2fmu.fmu.exporting.compile_libraries", compile_libraries)


@pytest.fixture(scope="session")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Exported:
    """``exported(name_or_mechanism, solver=..., outputs=..., **arguments)``: an FMU, built once a session."""
    built: dict[object, Fmu] = {}
    seen: list[str | Mechanism] = []  # kept, so that no other mechanism gets the id of one that is in use

    def build(
        model: str | Mechanism, *, solver: str = DEFAULT_SOLVER, outputs: tuple[str, ...] = (), **arguments: object
    ) -> Fmu:
        key = (model if isinstance(model, str) else id(model), solver, outputs, tuple(sorted(arguments.items())))
        if key not in built:
            mechanism = load(model, arguments) if isinstance(model, str) else model
            path: Path = tmp_path_factory.mktemp("fmu") / f"{mechanism.name}.fmu"
            seen.append(model)
            built[key] = export(mechanism, path, solver=solver, outputs=outputs)
        return built[key]

    return build

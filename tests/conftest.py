"""What several tests share: exported FMUs, one build a session and model."""

from __future__ import annotations

import gc
import os
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

import pytest
from rewriting import rewrite_shared

from lag2fmu import archives, progress
from lag2fmu.building import build_cache, process
from lag2fmu.codegen import DEFAULT_SOLVER
from lag2fmu.fmu import Fmu, compilers, export, translation_units
from lag2fmu.fmu.contents import EQUATIONS
from lag2fmu.fmu.live import module
from lag2fmu.fmu.platforms import Platform
from lag2fmu.formats import loading
from lag2fmu.formats.loading import load
from lag2fmu.mechanism import Mechanism
from lag2fmu.resources import bundled
from lag2fmu.verify import apart, instances

Exported = Callable[..., Fmu]


SLOW = Path(__file__).with_name("slow.txt")
"""The tests that are left out of 'make test' for their time, beside those that carry the marker slow."""
LIMIT = 0.7
"""A test that takes longer than this (s) belongs into SLOW."""
WEEK = 7 * 24 * 3600.0
"""s"""
FLAGS, PACKED = compilers._flags, archives.PACKED
MOST, FEW, GROUP = translation_units.MOST, translation_units.FEW, translation_units._group
"""Those of users."""

_seconds: dict[str, float] = defaultdict(float)


def pytest_addoption(parser: pytest.Parser) -> None:
    """The options of this project's tests."""
    parser.addoption("--update", action="store_true", help="write golden files anew; read the diff before you commit")
    parser.addoption("--all-models", action="store_true", help="what takes minutes with every model ('make test-all')")
    parser.addoption("--optimised", action="store_true", help="compile all as users get it, which takes an hour")
    parser.addoption("--update-slow", action="store_true", help="list the tests of a whole run that take long anew")


def pytest_configure(config: pytest.Config) -> None:
    """All processes of a run, and later runs, compile the same sources once; ``--cache-clear`` forgets them.
    The user's cache is left alone.

    A page is live, and progress is shown, where a test asks for it.
    """
    os.environ.setdefault(build_cache.VARIABLE, str(config.cache.mkdir("libraries")))
    os.environ.setdefault(process.CACHE, str(config.cache.mkdir("compiler")))
    os.environ.setdefault(module.VARIABLE, "static")
    os.environ.setdefault(progress.QUIET, "1")


@pytest.hookimpl(tryfirst=True)
def pytest_collection(session: pytest.Session) -> None:
    """Processes that all collect the whole tree share its compilation."""
    if session.config.args_source == pytest.Config.ArgsSource.TESTPATHS:
        rewrite_shared(session.config, sorted(Path(__file__).parent.rglob("test_*.py")))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what SLOW lists; without ``--all-models`` leave out the tests with the marker all_models."""
    listed = set(SLOW.read_text("utf-8").splitlines())
    for item in items:
        if item.nodeid in listed:
            item.add_marker(pytest.mark.slow)
    if not config.getoption("--all-models"):
        left_out = [item for item in items if item.get_closest_marker("all_models")]
        items[:] = [item for item in items if item not in left_out]
        config.hook.pytest_deselected(items=left_out)


def pytest_collection_finish() -> None:
    """Leave what was imported and collected out of all searches for garbage, and search seldom: a 25th of the time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 50)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add up the seconds that set-up, call and teardown of each test take."""
    _seconds[report.nodeid] += report.duration


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Drop libraries that no run of this week used; with ``--update-slow`` list the tests that took longer than LIMIT.

    In the process that hears of all tests.
    """
    if "PYTEST_XDIST_WORKER" not in os.environ:
        for file, found in build_cache.kept_files(session.config.cache.mkdir("libraries")):
            if time.time() - found.st_mtime > WEEK:
                file.unlink()
    if session.config.getoption("--update-slow") and "PYTEST_XDIST_WORKER" not in os.environ:
        slow = sorted(name for name, seconds in _seconds.items() if seconds > LIMIT and "test_models.py" not in name)
        SLOW.write_text("".join(f"{name}\n" for name in slow), "utf-8")


@pytest.fixture
def compiled_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests of what the compiler makes: ``export`` compiles, whatever was compiled before."""
    monkeypatch.setenv(build_cache.VARIABLE, build_cache.OFF)


@contextmanager
def compiling(optimised: bool) -> Iterator[None]:
    """What is compiled in this process meanwhile is optimised, as users get it, or not.

    Without it the compiler takes a sixth of the time, and the result runs a few times as long. Its files are as few
    units as mechanisms of one size can share: those of the engine are found again, and take a tenth of the time then.
    Further units beside each other read the same headers anew. It is packed in a quarter of the time, too.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compilers, "_flags", FLAGS if optimised else _unoptimised)
        patch.setattr(translation_units, "MOST", MOST if optimised else sys.maxsize)
        patch.setattr(translation_units, "FEW", FEW if optimised else 0)
        patch.setattr(translation_units, "_group", GROUP if optimised else _shared_or_not)
        patch.setattr(archives, "PACKED", PACKED if optimised else 1)
        yield


def _shared_or_not(name: str, sources: Mapping[str, str]) -> tuple[int, str]:
    """What the C file ``name`` of ``sources`` {file: text} stands in one unit with: all that equally many share."""
    group = GROUP(name, sources)
    return group if group[0] in (1, 3) else (0, "engine")


def _unoptimised(sources: Mapping[str, str], compiler: str, platform: Platform) -> tuple[str, ...]:
    """The flags of users, and for zig one that leaves out the optimisation alone: without -O2 it builds other parts."""
    return (*FLAGS(sources, compiler, platform), *(("-Xclang", "-O0") if compiler == "zig" else ()))


@pytest.fixture(scope="session", autouse=True)
def compiled_quickly(pytestconfig: pytest.Config) -> Iterator[None]:
    """Nothing is optimised where no test asks for it, except with ``--optimised``."""
    with compiling(optimised=pytestconfig.getoption("--optimised")):
        yield


@pytest.fixture(scope="session", autouse=True)
def read_once() -> Iterator[None]:
    """A bundled model without arguments is read once in a process: nobody changes a mechanism, and many tests ask."""
    read, names = loading.read_model, frozenset(bundled())
    kept = lru_cache(maxsize=None)(read)

    def read_model(model: object, arguments: Mapping[Any, object] | None = None) -> Mechanism:
        return kept(model) if isinstance(model, str) and model in names and not arguments else read(model, arguments)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(loading, "read_model", read_model)
        yield


@pytest.fixture(scope="module")
def optimised() -> Iterator[None]:
    """For tests of what users get from the compiler, and for long runs. Later tests of a module have it too."""
    with compiling(optimised=True):
        yield


@pytest.fixture
def optimised_alone() -> Iterator[None]:
    """The same for one test."""
    with compiling(optimised=True):
        yield


@pytest.fixture
def unoptimised(monkeypatch: pytest.MonkeyPatch) -> None:
    """For programs that are counted, and FMUs with a bound for steps, where neither work nor memory is what is tested.

    What compilers make of single files is optimised else, for each processor whose memory is told.
    """
    from compiling import UNOPTIMISED  # it asks for the machine's platform, which only those who compile need

    monkeypatch.setattr(compilers, "FLAGS", (*compilers.FLAGS, *UNOPTIMISED["zig"]))


@pytest.fixture(scope="session")
def exported(tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config) -> Exported:
    """``exported(name_or_mechanism, solver=..., outputs=..., fmi=..., **arguments)``: an FMU, built once a session.

    By default it is optimised with ``--optimised`` alone, see ``compiling``. Only tests of the page ask for its
    equations, by ``without=()``. It is not run in a process of its own first, as any other FMU is: if it crashed, the
    test would be named all the same.
    """
    built: dict[object, Fmu] = {}
    seen: list[str | Mechanism] = []  # kept, so that no other mechanism gets the id of one that is in use

    def build(
        model: str | Mechanism,
        *,
        solver: str | None = DEFAULT_SOLVER,
        outputs: tuple[str, ...] = (),
        fmi: str = "2.0",
        arrays: bool = False,
        without: tuple[str, ...] = (EQUATIONS,),
        optimised: bool | None = None,
        **arguments: object,
    ) -> Fmu:
        if optimised is None:
            optimised = pytestconfig.getoption("--optimised")
        chosen = (solver, outputs, fmi, arrays, without, optimised)
        key = (model if isinstance(model, str) else id(model), *chosen, tuple(sorted(arguments.items())))
        if key not in built:
            mechanism = load(model, arguments) if isinstance(model, str) else model
            path: Path = tmp_path_factory.mktemp("fmu") / f"{mechanism.name}.fmu"
            seen.append(model)
            with compiling(optimised):
                options = {"solver": solver, "outputs": outputs, "fmi": fmi, "arrays": arrays, "without": without}
                built[key] = export(mechanism, path, **options)
            apart._proven.add(instances.state_of(path))
        return built[key]

    return build

"""The memory of a call, from the compiler: how deep its stack is, and that the arena holds what it takes.

The depth is that of the deepest path in gcc's call graph with the frames of all functions. A function that is called by
its address has no caller there, and counts as called wherever an address is. Files are joined as an export joins them,
and -O1 stands for -O2 in half the time: what it inlines less makes paths longer, and the depths differ by some percent
in small mechanisms, while in large ones those of -O1 are the greater ones.
"""

from __future__ import annotations

import ctypes
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

import pytest
from compiling import COMPILERS, UNOPTIMISED, compiled

from benchmarks.spheres import spheres
from lag2fmu.codegen.sources import render_sources
from lag2fmu.dynamics import derive, lower
from lag2fmu.fmu.backends.native import describe, fmi_headers
from lag2fmu.fmu.compilers import FLAGS
from lag2fmu.fmu.deriving import derived
from lag2fmu.fmu.translation_units import translation_units
from lag2fmu.fmu.variables import build_table
from lag2fmu.fmu.versions import VERSIONS
from lag2fmu.formats.loading import load
from lag2fmu.resources import resource_folder
from lag2fmu.solvers.methods import METHODS

pytestmark = [
    pytest.mark.toolchain,
    pytest.mark.fmu,
    pytest.mark.skipif("gcc" not in COMPILERS, reason="no gcc: it writes the call graph"),
]

MOST_STACK = 64 * 1024
"""Bytes."""
LARGE = {"n_pendulum": {"n": 40}}
"""Structural arguments that make a mechanism large."""
NODE = re.compile(r'node: \{ title: "([^"]+)" label: "[^"]*?(\d+) bytes \(')
CALL = re.compile(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"')
BY_ADDRESS = "__indirect_call"


def _frames(folder: Path, file: str, flags: tuple[str, ...]) -> str:
    """gcc's call graph of a file, with the frames of its functions."""
    headers = [f"-I{fmi_headers(version)}" for version in VERSIONS.values()]
    command = ["gcc", *FLAGS, "-O1", *flags, "-w", "-c", "-fcallgraph-info=su", *headers, file]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return (folder / file.replace(".c", ".ci")).read_text("utf-8")


def deepest(folder: Path, sources: Mapping[str, str], *flags: str) -> tuple[int, list[str]]:
    """The stack (bytes) of the deepest path of calls in the C ``sources``, and the functions on it."""
    units = translation_units(sources)
    for name, text in {**sources, **units}.items():
        (folder / name).write_text(text, "utf-8")
    graphs = [_frames(folder, unit, flags) for unit in units]
    frames = {name: int(size) for graph in graphs for name, size in NODE.findall(graph)}
    calls: dict[str, set[str]] = defaultdict(set)
    for graph in graphs:
        for caller, called in CALL.findall(graph):
            calls[caller].add(called)
    called = set().union(*calls.values())
    calls[BY_ADDRESS] = {name for name in frames if ":" in name and name not in called}
    depths: dict[str, tuple[int, list[str]]] = {}

    def depth(name: str, above: tuple[str, ...] = ()) -> tuple[int, list[str]]:
        if name not in depths:
            below = [depth(other, (*above, name)) for other in calls[name] if other not in (*above, name)]
            size, path = max(below, default=(0, []))
            depths[name] = (frames.get(name, 0) + size, [name, *path])
        return depths[name]

    return max(map(depth, frames))


def _sources(model: str, solver: str, fmi: str) -> Mapping[str, str]:
    found = derived(load(model, LARGE.get(model)), solver)
    return describe(found.mechanism, found.equations, found.program, found.solver, (), VERSIONS[fmi])[1]


def _spheres(count: int) -> Mapping[str, str]:
    equations = derive(spheres(count))
    return describe(equations.mechanism, equations, lower(equations), "dopri5", (), VERSIONS["2.0"])[1]


def _capacity(folder: Path) -> int:
    """The bytes that calls of the sources in ``folder`` may take of the arena without a reservation."""
    text = '#include <stdio.h>\n#include "arena_size.h"\nint main(void) { printf("%.0f", (double)ARENA_WORK); }\n'
    (folder / "capacity.c").write_text(text, "utf-8")
    subprocess.run(["gcc", "-std=c99", "capacity.c", "-o", "capacity"], cwd=folder, check=True)
    return int(subprocess.run([folder / "capacity"], capture_output=True, text=True, check=True).stdout)


def check(folder: Path, sources: Mapping[str, str], large: bool) -> None:
    """The arena holds what calls would have on the stack else; the stack of any call of a ``large`` mechanism is small.

    What grows with a mechanism and is not taken from the arena would make the stack of a large one deep, and that of a
    small one deeper than the arena. The objects of a large one remain in the ``folder``.
    """
    on_stack = deepest(folder, sources, "-DARENA_ON_STACK")
    assert on_stack[0] <= _capacity(folder), on_stack[1]
    assert not large or deepest(folder, sources)[0] <= MOST_STACK


def test_the_deepest_path_is_found(tmp_path: Path) -> None:
    """By a call in the file, by one of another file, and by one by address."""
    one = "void two(void (*f)(void)); static void deep(void) { volatile char a[5000]; a[0] = 0; }\n"
    one += "void one(void) { volatile char a[1000]; a[0] = 0; two(deep); }"
    two = "void two(void (*f)(void)); void two(void (*f)(void)) { volatile char a[2000]; a[0] = 0; f(); a[1] = 0; }"
    size, path = deepest(tmp_path, {"one.c": one, "two.c": two}, "-O0")
    assert 7800 < size < 8500
    assert path[-1].endswith("deep")


@pytest.mark.parametrize(
    ("model", "solver", "fmi", "large"),
    [
        ("woodpecker", "dopri5", "2.0", False),
        ("stack_of_blocks", "radau5", "3.0", False),
        ("parallel_manipulator", "dopri5", "3.0", False),
        ("six_axis_arm", "ros2", "2.0", True),
        ("n_pendulum", "gauss4", "3.0", True),
        ("humanoid_planar", "radau5", "2.0", True),
    ],
)
def test_stack_with_every_family_of_solvers(model: str, solver: str, fmi: str, large: bool, tmp_path: Path) -> None:
    check(tmp_path, _sources(model, solver, fmi), large)


def test_stack_without_masses_and_with_time_stepping(tmp_path: Path) -> None:
    for model, solver in (("slides_problem_5_massless", "radau5"), ("stack_of_blocks", "moreau")):
        (folder := tmp_path / model).mkdir()
        check(folder, _sources(model, solver, "2.0"), large=False)


def test_stack_of_studies(tmp_path: Path) -> None:
    found = derived(load("woodpecker"), "dopri5")
    tables = build_table(found.equations, found.program).tables
    check(tmp_path, render_sources(found.program, tables, METHODS["dopri5"], "", "study"), large=False)


RUN = """#include <stdlib.h>
#include "fmi2Functions.h"
#include "instance.h"
static fmi2CallbackFunctions callbacks;
int run(int model_exchange, double step, int steps);
int run(int model_exchange, double step, int steps) {
    fmi2Component c = fmi2Instantiate("run", model_exchange ? fmi2ModelExchange : fmi2CoSimulation, MODEL_GUID, NULL,
                                      &callbacks, fmi2False, fmi2False);
    double *x = malloc(2 * N_STATES * sizeof(double)), *rates = x + N_STATES;
    fmi2EventInfo info;
    int done = 0;
    fmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0);
    fmi2EnterInitializationMode(c);
    int good = fmi2ExitInitializationMode(c) == fmi2OK;
    if (model_exchange && good) {
        good = fmi2NewDiscreteStates(c, &info) == fmi2OK && fmi2EnterContinuousTimeMode(c) == fmi2OK;
    }
    for (; done < steps && good; done++) {
        fmi2Boolean enter = fmi2False, terminate = fmi2False;
        if (!model_exchange) {
            good = fmi2DoStep(c, done * step, step, fmi2True) == fmi2OK;
            continue;
        }
        good = fmi2GetContinuousStates(c, x, N_CONTINUOUS) == fmi2OK &&
               fmi2GetDerivatives(c, rates, N_CONTINUOUS) == fmi2OK;
        for (int i = 0; i < N_CONTINUOUS; i++) {
            x[i] += step * rates[i];
        }
        good = good && fmi2SetTime(c, (done + 1) * step) == fmi2OK &&
               fmi2SetContinuousStates(c, x, N_CONTINUOUS) == fmi2OK &&
               fmi2CompletedIntegratorStep(c, fmi2True, &enter, &terminate) == fmi2OK;
        if (good && enter) {
            good = fmi2EnterEventMode(c) == fmi2OK && fmi2NewDiscreteStates(c, &info) == fmi2OK &&
                   fmi2EnterContinuousTimeMode(c) == fmi2OK;
        }
    }
    free(x);
    fmi2FreeInstance(c);
    return good ? done : -1;
}
int main(int count, char *arguments[]) {
    const int steps = atoi(arguments[3]);
    return count == 4 && run(atoi(arguments[1]), atof(arguments[2]), steps) == steps ? 0 : 1;
}
"""


@pytest.mark.skipif(sys.platform == "win32", reason="ulimit sets the stack")
def test_many_spheres_run_on_a_small_stack(tmp_path: Path) -> None:
    """Located events and model exchange with 239 rows and 300 coordinates, whose mass matrix would take 720 kB.

    Impacts and stops of slips, and steps of an importer's solver, run on 256 kB with those of the C library.
    """
    check(tmp_path, _spheres(60), large=True)
    (tmp_path / "run.c").write_text(RUN, "utf-8")
    objects = [file.with_suffix(".o").name for file in tmp_path.glob("*.ci")]
    command = ["gcc", *FLAGS, "-w", f"-I{fmi_headers()}", "run.c", *objects, "-lm", "-o", "run"]
    subprocess.run(command, cwd=tmp_path, check=True)
    for arguments in ("0 1e-3 3", "1 1e-4 3"):
        subprocess.run(["sh", "-c", f"ulimit -s 256; ./run {arguments}"], cwd=tmp_path, check=True)


REFUSING = """#include <stdlib.h>
static inline void *no_memory(size_t size) { (void)size; return NULL; }
static inline void *no_zeros(size_t count, size_t size) { (void)count; (void)size; return NULL; }
#ifdef REFUSE_INSTANCES
#define calloc no_zeros
#endif
#ifdef REFUSE_BLOCKS
#define malloc no_memory
#endif
"""


def _instance(folder: Path, *options: str) -> tuple[int | None, list[str]]:
    """The address of an instance of an FMU that is compiled with these options, and what it logs."""
    sources = _sources("stack_of_blocks", "dopri5", "2.0")
    options = ("-include", "refusing.h", *UNOPTIMISED["zig"], *options)
    library = compiled(folder, {**sources, "refusing.h": REFUSING}, options=options)
    logged: list[str] = []
    logger = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, *[ctypes.c_char_p] * 2)
    hear = logger(lambda _e, _n, _s, _c, text: logged.append(text.decode()))
    callbacks = (ctypes.c_void_p * 5)(ctypes.cast(hear, ctypes.c_void_p))
    library.fmi2Instantiate.restype = ctypes.c_void_p
    guid = re.search(r'MODEL_GUID\[\] = "([^"]+)"', sources["tables.c"])
    assert guid is not None
    made = library.fmi2Instantiate(b"one", 1, guid[1].encode(), None, callbacks, 0, 0)
    return made, logged


def test_an_instance_without_memory_is_refused(tmp_path: Path) -> None:
    made, logged = _instance(tmp_path, "-DREFUSE_INSTANCES")
    assert not made
    assert re.search(r"there is no memory for an instance of \d+ bytes, of which \d+ are for work", logged[0])


GROWING = """#include <assert.h>
#undef NDEBUG
#include "arena.h"
static double memory[64];
int main(void) {
    Arena *arena = arena_begin(memory, 64, 0);
    const ArenaMark mark = arena_mark(arena);
    assert(arena_reserve(arena, 64) && arena_take(arena, 64) != NULL);
    const bool grown = arena_reserve(arena, 1000);
    if (grown) {
        char *first = arena_take(arena, 1000);
        memset(first, 1, 1000);
        arena_release(mark);
        assert(arena->next == mark.next && arena->block == &arena->first && arena->refused == 0);
        arena_take(arena, 64);
        assert(arena_reserve(arena, 900) && arena_take(arena, 900) == first);
    } else {
        assert(arena->refused == 1000);
    }
    arena_release(mark);
    arena_end(arena);
    assert(arena->first.after == NULL);
    return grown ? 0 : 2;
}
"""


@pytest.mark.parametrize(
    ("option", "folder", "code"),
    [
        ("-DGROW", "heap/arena_blocks.c", 0),
        ("-DREFUSE_BLOCKS", "heap/arena_blocks.c", 2),
        ("-DNO_HEAP", "heap_none/arena_blocks_none.c", 2),
    ],
)
def test_the_arena_grows_or_tells_what_it_lacks(option: str, folder: str, code: int, tmp_path: Path) -> None:
    """A further block is kept for the next time, and freed with the arena. Without a heap there is none."""
    base = resource_folder("templates") / "engine" / "base"
    for name, text in {"growing.c": GROWING, "refusing.h": REFUSING}.items():
        (tmp_path / name).write_text(text, "utf-8")
    command = ["gcc", "-std=c99", "-g", "-fsanitize=address,undefined", "-include", "refusing.h", option, f"-I{base}"]
    blocks = base / folder
    subprocess.run([*command, "growing.c", base / "arena.c", blocks, "-o", "growing"], cwd=tmp_path, check=True)
    assert subprocess.run([tmp_path / "growing"], check=False).returncode == code

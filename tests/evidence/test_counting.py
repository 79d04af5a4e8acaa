"""What steps take: operations that are known, the same motion as without a counter, and a work that hardly varies."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bare import program
from compiling import QUICK

from lag2fmu.evidence.counting import counted, counting, instructions_of
from lag2fmu.evidence.realtime import errors_of
from lag2fmu.fmu.compilers import compile_unit, host_target
from lag2fmu.fmu.firmware import firmware
from lag2fmu.formats.loading import load
from lag2fmu.mechanism.record import complete
from lag2fmu.verify.reference_files import reference_of

pytestmark = pytest.mark.fmu

KNOWN_WORK = """
#include <math.h>
double work(int n, const double *x);
double work(int n, const double *x) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
        sum += x[i] > 0.0 ? sqrt(x[i]) * 3.0 : sin(x[i]) / (x[i] - 1.0);
    }
    return -fabs(sum);
}
"""
"""A term takes 3 operations where x > 0, else 4 (a function is one): signs, comparisons and magnitudes are none."""
PRINTED = """
#include <stdio.h>
double work(int n, const double *x);
extern long long counted_operations;
int main(void) {
    const double x[] = {1.0, 2.0, -1.0, 3.0, -2.0};
    volatile double y = work(5, x);
    (void)y;
    printf("%lld", counted_operations);
    return 0;
}
"""


def test_operations_that_are_known(tmp_path: Path) -> None:
    code = compile_unit({"work.c": KNOWN_WORK}, "work.c", (host_target(),), "-S", "-emit-llvm").decode()
    files = {"work.ll": counting(code), "main.c": PRINTED}
    (tmp_path / "run.exe").write_bytes(compile_unit(files, "work.ll", (host_target(),), "main.c", "-lm"))
    (tmp_path / "run.exe").chmod(0o755)
    assert subprocess.run([tmp_path / "run.exe"], capture_output=True, text=True, check=True).stdout == str(
        3 * 3 + 2 * 4
    )


@pytest.mark.usefixtures("unoptimised")
def test_a_run_that_is_counted_is_the_run(tmp_path: Path) -> None:
    """Bit for bit, with contacts; a step in the air takes less than one with an impact."""
    made = firmware("woodpecker", own_math=True)
    found = counted(made, instructions=False)
    done = subprocess.run([program(made.files, tmp_path, *QUICK)], capture_output=True, text=True, check=True)
    printed = np.array([line.split(",")[1:] for line in done.stdout.splitlines()[1:]], float)
    assert np.array_equal(found.values, printed)
    assert len(found.operations) == len(printed) - 1
    assert 0 < found.operations.min() < 0.6 * found.operations.max()


def test_four_evaluations_a_step_of_rk4() -> None:
    """What a step takes grows with the solver steps in it, each with four evaluations of a known length."""
    takes = []
    for steps in (1, 2):
        made = firmware("double_pendulum", solver_steps=steps)
        takes.append(float(np.median(counted(made, instructions=False).operations)))
    evaluation = (takes[1] - takes[0]) / 4
    assert 40 < evaluation < 200


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="no valgrind")
@pytest.mark.parametrize("model", ["cart_pole", "pendulum", "four_bar_linkage", "bricard", "six_axis_arm"])
def test_instructions_hardly_vary(model: str) -> None:
    """Without contacts the most that a step takes is near the median over the experiment."""
    instructions = instructions_of(firmware(model))
    assert len(instructions) > 30
    assert instructions.max() <= 1.2 * np.median(instructions)


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="no valgrind")
@pytest.mark.parametrize(
    ("model", "stop"),
    [
        pytest.param("crane", None, id="crane"),
        pytest.param("rocking_block", 10.0, id="rocking_block"),
        pytest.param("sliding_sphere", None, id="sliding_sphere"),
    ],
)
def test_an_impact_takes_no_more_than_twice_a_step(model: str, stop: float | None) -> None:
    """The most expensive step has impacts of two coupled contacts, or a contact that begins to slip another way.

    Until the ``stop`` time (s); None: that of the experiment. A block that rocks on one edge at a time has cheap steps,
    and half of its experiment has no others.
    """
    mechanism = load(model)
    span = replace(mechanism.experiment, stop_time=stop or mechanism.experiment.stop_time)
    instructions = instructions_of(firmware(complete(replace(mechanism.description, experiment=span))))
    assert instructions.max() <= 2 * np.median(instructions)


@pytest.mark.usefixtures("unoptimised")
@pytest.mark.parametrize("model", ["cart_pole", "four_bar_linkage", "bouncing_ball"])
@pytest.mark.parametrize("step", [1e-3, 1e-2])  # s, no longer than that of the experiment
def test_errors_that_are_reported_are_those_of_an_independent_integration(model: str, step: float) -> None:
    """To 20 %, in steps of a length that is named, where they are above what the independent path knows."""
    described = load(model).description
    step = min(step, described.experiment.step)
    mechanism = complete(replace(described, experiment=replace(described.experiment, step=step)))
    made = firmware(mechanism, step=step, solver_steps=1)
    run = counted(made, instructions=False)
    reference = reference_of(mechanism, limit=60.0)
    size = min(len(run.values), len(reference.trajectory.time))
    reported = errors_of(made, run.values[:size], run.values[:size])
    compared = 0
    for name, told, clear in zip(made.outputs, reported.steps.found, reported.steps.clear, strict=True):
        if name not in reference.error.names:
            continue
        unknown = reference.error[name][:size].max()
        found = np.abs(run.values[:size, [*made.outputs].index(name)] - reference.trajectory[name][:size]).max()
        if clear and found > 10 * unknown:
            compared += 1
            assert told == pytest.approx(found, rel=0.2), name
    if not compared:
        pytest.skip("the errors are below those of the direct integration")

"""The report on plain C: stack against a painted one, code and constants, and what it says."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from lag2fmu.cli import main
from lag2fmu.evidence.realtime import realtime_report
from lag2fmu.fmu.compilers import FLAGS, compiler_command
from lag2fmu.fmu.firmware import firmware
from lag2fmu.fmu.footprint import deepest, footprints

ENTRIES = r"\w+_(init|set|get|start|step|time|failure|notices)"
"""What programs call."""
PAINTED = """
#define _XOPEN_SOURCE 600
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include "NAME.h"
enum { ROOM = 1 << 20, COLOUR = 0xA5 };
static unsigned char stack[ROOM];
static NAME_Memory memory;
static unsigned char *volatile at;
static void *run(void *given) {
    unsigned char here = 0;
    (void)given;
    at = &here;
    NAME_Instance *it = NAME_init(&memory, sizeof memory);
    NAME_start(it, 0.0);
    double value;
    for (int k = 0; k < STEPS; k++) {
        if (NAME_step(it, NAME_STEP) != NAME_OK) return given;
        for (int v = 0; v < NAME_VARIABLES; v++) NAME_get(it, v, &value);
    }
    return NULL;
}
int main(void) {
    pthread_t thread;
    pthread_attr_t how;
    void *failed;
    memset(stack, COLOUR, sizeof stack);
    pthread_attr_init(&how);
    pthread_attr_setstack(&how, stack, sizeof stack);
    pthread_create(&thread, &how, run, &thread);
    pthread_join(thread, &failed);
    int deep = 0;
    while (stack[deep] == COLOUR) deep++;
    printf("%d", failed ? -1 : (int)(at - (stack + deep)));
    return 0;
}
"""
"""A program that runs a mechanism on a painted stack and prints how many bytes of it were used."""


@pytest.mark.fmu
@pytest.mark.skipif(sys.platform != "linux", reason="the painted stack is one of a thread of POSIX")
@pytest.mark.parametrize(("model", "steps"), [("cart_pole", 1000), ("falling_rod", 1500), ("four_bar_linkage", 500)])
def test_the_stack_that_is_used_is_what_is_reported(model: str, steps: int, tmp_path: Path) -> None:
    made = firmware(model, own_math=True)
    reported = footprints(f"{model}.c", made.files, ENTRIES, ["x86-64"])[0].stack
    for name, text in made.files.items():
        (tmp_path / name).write_text(text)
    count = made.files[f"{model}.h"].count(f"{model}_VAR_")
    text = PAINTED.replace("NAME_VARIABLES", str(count)).replace("NAME", model).replace("STEPS", str(steps))
    (tmp_path / "painted.c").write_text(text)
    command = [*compiler_command("zig", "x86_64-linux-gnu.2.17"), *FLAGS, "painted.c", f"{model}.c", "-o", "painted"]
    subprocess.run([*command, "-lpthread", "-lm"], cwd=tmp_path, check=True)
    used = int(subprocess.run([tmp_path / "painted"], check=True, capture_output=True, text=True).stdout)
    assert 0.5 * reported <= used <= reported + 128, "128: the frame of the program's own loop"


LISTING = """
	.globl	one
	.type	one,@function
one:
.Lfunc_begin0:
	callq	two
	callq	*%rax
	.section	.stack_sizes
	.quad	.Lfunc_begin0
	.byte	24
	.type	two,@function
two:
.Lfunc_begin1:
	jmp	memcpy@PLT
	.quad	.Lfunc_begin1
	.ascii	"\\310\\001"
	.type	three,@function
three:
.Lfunc_begin2:
	callq	two
	.quad	.Lfunc_begin2
	.byte	100
"""


def test_the_deepest_path_of_a_listing() -> None:
    """One calls two, and by address three, which nobody calls by its name."""
    assert deepest(LISTING, {"one"}, 8) == (24 + 100 + 200 + 3 * 8, ("one", "three", "two"))
    assert deepest(LISTING, {"two"}) == (200, ("two",))


@pytest.mark.fmu
def test_what_a_report_says(tmp_path: Path) -> None:
    made = firmware("pendulum", real="float")
    text = realtime_report(made, firmware("pendulum"))
    assert f"- memory of an instance: {made.size} bytes" in text
    sizes = {f.processor: f for f in footprints("pendulum.c", made.files, ENTRIES)}
    assert 5_000 < sizes["Cortex-M4F"].code < sizes["x86-64"].code * 1.2 < 60_000
    assert f"| Cortex-M4F | {sizes['Cortex-M4F'].code} |" in text
    least, median, most = map(int, re.search(r"operations \| (\d+) \| (\d+) \| (\d+) \|", text).groups())
    assert 100 < least <= median <= most < 1e4
    greatest, steps, single = re.search(r"\| theta, rad \| (\S+) \| (.*) \| (\S+) \|", text).groups()
    assert 0.1 < float(greatest) < 2
    assert float(steps.removeprefix("below ")) < 1e-9 < float(single) < 1e-4
    assert ("| instructions |" in text) == (shutil.which("valgrind") is not None)
    done = CliRunner().invoke(main, ["c", "pendulum", "-o", str(tmp_path / "p"), "--real", "float", "--report"])
    assert done.exit_code == 0
    assert (tmp_path / "p" / "REPORT.md").read_text() == text


def test_a_report_is_alone() -> None:
    done = CliRunner().invoke(main, ["show", "pendulum", "--realtime", "--analysis"])
    assert done.exit_code == 2
    assert "--realtime is a report of its own" in done.output

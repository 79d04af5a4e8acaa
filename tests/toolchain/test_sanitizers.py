"""The sources of exported FMUs under sanitizers, and their libraries under valgrind, in a C host of our own."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import hosts
import pytest
from delivered import unpack_sources

pytestmark = [
    pytest.mark.toolchain,
    pytest.mark.fmu,
    pytest.mark.skipif(
        sys.platform != "linux" or shutil.which("gcc") is None, reason="sanitizers are used with gcc on Linux"
    ),
]

GCC = ["gcc", "-std=c99"]
Run = Callable[..., "subprocess.CompletedProcess[str]"]
LOOKED_INTO = [model for model in hosts.REPRESENTATIVE if model != "cart_pole"]
"""Those with the hybrid ones, and with FMUs of FMI 3.0, run all lines of C that any others run. So gcov says."""


@pytest.fixture(scope="module")
def under(exported, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, list[str]], Run]:
    """``under(model, flags)(action, ...)``: host and FMU, both compiled with ``flags``, do an action."""
    programs: dict[str, Path] = {}
    folders: dict[tuple[str, str], Path] = {}

    def prepare(model: str, flags: list[str]) -> Run:
        key = " ".join(flags)
        if key not in programs:
            target = tmp_path_factory.mktemp("host") / "host"
            command = [*GCC, *hosts.STRICT, "-Wconversion", *flags]
            programs[key] = hosts.build(target, command, hosts.HOST, "-ldl", "-lpthread", "-lm")
        if (model, key) not in folders:
            fmu = exported(hosts.representative(model))
            folder = folders[model, key] = tmp_path_factory.mktemp(model)
            sources = [unpack_sources(fmu, folder)]
            hosts.build(folder / "fmu.so", [*GCC, *flags, "-shared", "-fPIC"], sources, "-lm")
            (folder / "fmu.txt").write_text(hosts.description(fmu))
        folder = folders[model, key]
        return lambda *action: hosts.run([str(programs[key]), "./fmu.so", "fmu.txt", *map(str, action)], folder)

    return prepare


def succeeded(done: subprocess.CompletedProcess[str]) -> str:
    """What a run printed that went well and had nothing to complain of."""
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
    assert done.stderr == ""
    return done.stdout


def random_calls(run: Run, count: int, seeds: tuple[int, ...]) -> Counter[tuple[str, str, str, str]]:
    """How often (kind, function, state and legality, verdict) was met; none is accepted where it is illegal."""
    met: Counter[tuple[str, str, str, str]] = Counter()
    for seed in seeds:
        for line in succeeded(run("random_calls", count, seed)).splitlines():
            kind, function, *states = line.split()
            for state, legal, accepted, refused in (re.split(r"[:/]", cell[0] + ":" + cell[1:]) for cell in states):
                met[kind, function, state + legal, "accepted"] += int(accepted)
                met[kind, function, state + legal, "refused"] += int(refused)
    assert len(met) == 2 * 6 * 44 * 2
    for (kind, function, (_, legal), verdict), times in met.items():
        if legal == ".":
            assert times == 0 or verdict == "refused", (kind, function, "is accepted where it is illegal")
    return met


@pytest.mark.parametrize("model", LOOKED_INTO)
def test_address_leak_and_undefined_behaviour(model: str, under) -> None:
    """2000 lives of instances, of which each would show its leak, and random calls."""
    run = under(model, hosts.ADDRESS)
    assert succeeded(run("cycles", 2000)) == "2000 cycles\n"
    met = random_calls(run, 75_000, (1, 2))
    legal_met = [met[key] for key in met if key[2][1] != "." and key[3] == "accepted"]
    illegal_met = [met[key] for key in met if key[2][1] == "." and key[3] == "refused"]
    assert min(legal_met) > 0, "every function was called in every state where it is legal"
    assert sum(map(bool, illegal_met)) > 0.9 * len(illegal_met), "and in nearly all where it is not"


@pytest.mark.parametrize("model", hosts.HYBRID)
def test_random_calls_of_hybrid_mechanisms(model: str, under) -> None:
    """Over impacts and changes between sticking and sliding.

    Not by seed 1: its call 8598 on a woodpecker is a step whose random numbers make it chatter to the bound of a
    million events, which takes 23 s.
    """
    run = under(model, hosts.ADDRESS)
    assert succeeded(run("cycles", 1000)) == "1000 cycles\n"
    random_calls(run, 20_000, (2, 3))


@pytest.mark.parametrize("model", ["double_pendulum", "linkage"])
def test_forged_states(model: str, under) -> None:
    """Each word of a serialized state replaced by numbers that are no index, with the checksum that belongs to it."""
    taken = int(succeeded(under(model, hosts.ADDRESS)("forge", 10_000)).split()[0])
    assert 0 < taken < 10_000


@pytest.mark.parametrize("model", ["double_pendulum", "linkage", "slides_problem_5_small", "bouncing_ball"])
def test_threads(model: str, under) -> None:
    """Without and with constraints, without mass, with events: what the engine has that is static is in one of them.

    100 instances, each in a thread of its own, move like instances that are alone, bit for bit."""
    assert succeeded(under(model, hosts.THREAD)("threads", 100)) == "100 threads\n"


def test_the_sanitizers_see_what_goes_wrong(under) -> None:
    """So that their silence means something."""
    run = under("double_pendulum", hosts.ADDRESS)
    assert "LeakSanitizer: detected memory leaks" in run("leak").stderr
    assert "AddressSanitizer: heap-buffer-overflow" in run("overrun").stderr
    assert "ThreadSanitizer: data race" in under("double_pendulum", hosts.THREAD)("race").stderr


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="there is no valgrind on this machine")
@pytest.mark.parametrize("model", ["cart_pole", "linkage", "bouncing_ball"])
def test_valgrind(model: str, exported, tmp_path: Path) -> None:
    """The library that is shipped, which no sanitizer sees into: it reads nothing that was not written."""
    fmu = exported(hosts.representative(model))
    (tmp_path / "fmu.so").write_bytes(hosts.library(fmu))
    (tmp_path / "fmu.txt").write_text(hosts.description(fmu))
    host = hosts.build(tmp_path / "host", [*GCC, "-O1"], hosts.HOST, "-ldl", "-lpthread", "-lm")
    valgrind = [
        "valgrind",
        "-q",
        "--error-exitcode=9",
        "--leak-check=full",
        "--show-leak-kinds=definite,indirect,possible",
    ]
    command = [*valgrind, str(host), "./fmu.so", "fmu.txt"]
    assert succeeded(hosts.run([*command, "cycles", "1000"], tmp_path)) == "1000 cycles\n"
    succeeded(hosts.run([*command, "random_calls", "1000", "3"], tmp_path))
    leaking = hosts.run([*command, "leak"], tmp_path)
    assert leaking.returncode == 9
    assert "definitely lost" in leaking.stderr

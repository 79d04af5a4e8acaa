"""The peers in this process: CasADi, Pinocchio, MuJoCo. A peer that is not installed raises ImportError.

CasADi differentiates the same T and V by SX (p = dT/dqd, M = dp/dqd, h = dp/dq qd - dT/dq + dV/dq) and solves by an
LDL^T, generated with the rest or in C behind it; or it traces the articulated-body algorithm written by hand.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cases import Case
from benchmarks.entries import Entry, solve_operations
from benchmarks.recursive import Given, articulated, energies
from benchmarks.running import Source

MAX_OPERATIONS = 15000
"""Longer code of a peer is not compiled: it takes minutes and loses anyway."""


def casadi_lagrange(case: Case, generated_solve: bool) -> Entry:
    """The Lagrangian by SX; ``generated_solve``: with CasADi's own LDL^T."""
    ca = importlib.import_module("casadi")
    seconds, text, count = _casadi_lagrange(ca, case, generated_solve)
    return Entry(
        source=text,
        seconds=seconds,
        operations=count if generated_solve else count + solve_operations(case.n) + case.n,
        mass_operations=None if generated_solve else count,
        repeat=lambda: _casadi_lagrange(ca, case, generated_solve)[0],
    )


def casadi_articulated(case: Case) -> Entry:
    """The articulated-body algorithm written by hand, in SX; with its forward derivative."""
    ca = importlib.import_module("casadi")
    start = time.process_time()
    x, Q, p, given = _casadi_given(ca, case)
    qdd = ca.vertcat(*articulated(case, given))
    function = ca.Function("f", [x, Q, p], [ca.densify(qdd)], {"cse": True})
    text = casadi_text(ca, function)
    seconds = time.process_time() - start
    seeds = [ca.SX.sym(f"d{i}", v.numel()) for i, v in enumerate((x, Q, p))]
    rate = ca.jtimes(qdd, ca.vertcat(x, Q, p), ca.vertcat(*seeds))
    tangent = ca.Function("f", [x, Q, p, *seeds], [ca.densify(rate)], {"cse": True})
    return Entry(
        Source("casadi.c", text),
        seconds,
        _operations(ca, function),
        derivative=Source("casadi.c", casadi_text(ca, tangent)),
        derivative_operations=_operations(ca, tangent),
    )


def _casadi_given(ca: Any, case: Case) -> tuple[Any, Any, Any, Given]:
    n = case.n
    x, Q, p = ca.SX.sym("x", 2 * n), ca.SX.sym("Q", n), ca.SX.sym("p", len(case.values))
    scalars = [x[i] for i in range(2 * n)]
    named = {name: p[i] for i, name in enumerate(case.values)}
    return x, Q, p, Given(scalars[:n], scalars[n:], [Q[i] for i in range(n)], named, ca.sin, ca.cos)


def _casadi_lagrange(ca: Any, case: Case, generated_solve: bool) -> tuple[float, Source, int]:
    start = time.process_time()
    arguments, results = of_lagrangian(ca, case, generated_solve)
    function = ca.Function("f", arguments, results, {"cse": True})
    text = casadi_text(ca, function)
    kernel = "casadi.c" if generated_solve else "casadi_mass.c"
    return time.process_time() - start, Source(kernel, text), _operations(ca, function)


def casadi_function(ca: Any, case: Case, name: str) -> Any:
    """CasADi's function of x, Q and p called ``name``: dx/dt by its own LDL^T."""
    (x, Q, p), (qdd,) = of_lagrangian(ca, case, True)
    return ca.Function(name, [x, Q, p], [ca.densify(ca.vertcat(x[case.n :], qdd))], {"cse": True})


def of_lagrangian(ca: Any, case: Case, generated_solve: bool) -> tuple[list[Any], list[Any]]:
    """x, Q, p, and the accelerations, or without ``generated_solve`` M and h."""
    n = case.n
    q, qd, Q, p = ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("Q", n), ca.SX.sym("p", len(case.values))
    named = {name: p[i] for i, name in enumerate(case.values)}
    given = Given([q[i] for i in range(n)], [qd[i] for i in range(n)], [], named, ca.sin, ca.cos)
    T, V = energies(case, given)
    momenta = ca.gradient(T, qd)
    M = ca.jacobian(momenta, qd)
    h = ca.jtimes(momenta, q, qd) - ca.gradient(T, q) + ca.gradient(V, q)
    if generated_solve:
        D, LT, order = ca.ldl(ca.densify(M))
        results = [ca.ldl_solve(Q - h, D, LT, order)]
    else:
        results = [ca.densify(ca.triu(M)), ca.densify(h)]
    x = ca.SX.sym("x", 2 * n)
    return [x, Q, p], ca.substitute(results, [q, qd], [x[:n], x[n:]])


def _operations(ca: Any, function: Any) -> int:
    """The instructions of a function without constants and the traffic of arguments and results."""
    idle = {ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT}
    return sum(function.instruction_id(k) not in idle for k in range(function.n_instructions()))


def casadi_text(ca: Any, function: Any) -> str:
    """A function as C text, with the sizes that kernels/casadi.c asks for."""
    generator = ca.CodeGenerator("generated.c", {"with_header": False})
    generator.add(function)
    sizes = {"ARG": function.sz_arg(), "RES": function.sz_res(), "W": function.sz_w(), "IW": function.sz_iw()}
    macros = "".join(f"\n#define SZ_{name} {max(1, size)}" for name, size in sizes.items())
    return str(generator.dump()) + macros + "\n"


# ----------------------------------------------------------------------------------------- models made at run time


def _records(case: Case) -> list[list[float]]:
    """The rows of kernels/pinocchio.cpp; the links of a moving base have no mass but the cart's."""
    p, rows = case.values, []
    if not case.planar:
        for i, link in enumerate(case.segments(p)):
            rows.append([i - 1, link.axis, *link.place, link.mass, *link.center, *np.ravel(link.inertia)])
        return rows
    o = case.offset
    for axis in range(o):
        rows.append([axis - 1, 3 + axis, 0, 0, 0, p.get("mc", 0.0), *[0.0] * 12])
    rods = case.rods(p)
    for rod in rods:
        down = -rods[rod.parent].length if rod.parent >= 0 and rod.at_end else 0.0
        parent = o + rod.parent if rod.parent >= 0 else o - 1
        rows.append(
            [parent, 2, 0, down, 0, rod.mass, 0, -rod.center * rod.length, 0, *[0.0] * 8, rod.inertia],
        )
    return rows


def _gravity(case: Case) -> list[float]:
    g = case.values["g"]
    return [0.0, -g, 0.0] if case.planar else [0.0, 0.0, -g]


def _refuse_absolute(case: Case) -> None:
    if case.absolute:
        raise NotImplementedError("joint coordinates are relative")


def pinocchio(case: Case, shipped: bool) -> Entry:
    """ABA in C++: the wheel's compiled library (``shipped``), or its headers compiled for this processor."""
    prefix = Path(str(importlib.import_module("pinocchio").__file__))
    _refuse_absolute(case)
    start = time.process_time()
    root = next(parent for parent in prefix.parents if parent.name == "cmeel.prefix")
    eigen = next((str(p) for p in _eigen_folders(root) if (p / "Eigen" / "Dense").exists()), None)
    if eigen is None:
        raise ImportError("no headers of Eigen; the wheel of casadi brings them")
    flags = ["-O3", "-DNDEBUG", "-fno-gnu-unique", f"-I{root / 'include'}", f"-I{eigen}"]
    if shipped:
        flags += ["-DSHIPPED", f"-L{root / 'lib'}", "-lpinocchio_default", f"-Wl,-rpath,{root / 'lib'}"]
    else:
        flags += ["-march=native", "-ffp-contract=fast"]
    setup = np.array([*_gravity(case), *np.ravel(_records(case))])
    source = Source("pinocchio.cpp", "", {}, flags, setup=setup)
    return Entry(source, time.process_time() - start)


def _eigen_folders(root: Path) -> Iterator[Path]:
    yield root / "include" / "eigen3"
    casadi = find_spec("casadi")
    if casadi is not None and casadi.origin:
        yield Path(casadi.origin).parent / "include" / "eigen3"
    yield Path("/usr/include/eigen3")


def mujoco(case: Case, folder: Path) -> Entry:
    """MuJoCo's smooth dynamics, without the constraint solver."""
    package = Path(str(importlib.import_module("mujoco").__file__)).parent
    _refuse_absolute(case)
    start = time.process_time()
    model = folder / f"{case.name}.xml"
    model.write_text(mjcf_of(case), "utf-8")
    library = next(package.glob("libmujoco.so*"))
    flags = [f"-I{package / 'include'}", str(library), f"-Wl,-rpath,{package}"]
    source = Source("mujoco.c", "", {"MODEL": f'"{model}"'}, flags)
    return Entry(source, time.process_time() - start)


def mjcf_of(case: Case) -> str:
    """The mechanism as MJCF; massless links of a free base become joints of the link they carry."""
    rows = _records(case)
    children: dict[int, list[int]] = {}
    for i, row in enumerate(rows):
        children.setdefault(int(row[0]), []).append(i)

    def numbers(values: Sequence[float]) -> str:
        return " ".join(repr(float(v)) for v in values)

    def body(i: int, joints: str = "") -> str:
        row = rows[i]
        kind, axis = ("slide", int(row[1]) - 3) if row[1] >= 3 else ("hinge", int(row[1]))
        joints += f'<joint type="{kind}" axis="{numbers(np.eye(3)[axis])}"/>'
        if row[5] == 0.0:
            return "".join(body(child, joints) for child in children[i])
        I = np.reshape(row[9:], (3, 3))  # noqa: E741
        if case.planar:  # MuJoCo wants a tensor that a body can have; only Izz counts
            I = np.diag([max(I[2, 2], 1e-6), 1e-6, max(I[2, 2], 1e-6)])  # noqa: E741
        full = numbers([I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]])
        inertial = f'<inertial pos="{numbers(row[6:9])}" mass="{row[5]!r}" fullinertia="{full}"/>'
        inside = "".join(body(child) for child in children.get(i, []))
        return f'<body pos="{numbers(row[2:5])}">{joints}{inertial}{inside}</body>'

    option = f'<option gravity="{numbers(_gravity(case))}"><flag constraint="disable" contact="disable"/></option>'
    compiler = '<compiler angle="radian" boundmass="0" boundinertia="0"/>'
    return f"<mujoco>{compiler}{option}<worldbody>{body(0)}</worldbody></mujoco>"


Maker = Callable[[], Entry]


def peers(case: Case, folder: Path) -> dict[str, Maker]:
    """{label: what makes the entry} of all peers of this process."""
    return {
        "casadi lagrangian": lambda: casadi_lagrange(case, generated_solve=False),
        "casadi lagrangian ldl": lambda: casadi_lagrange(case, generated_solve=True),
        "casadi aba by hand": lambda: casadi_articulated(case),
        "pinocchio shipped": lambda: pinocchio(case, shipped=True),
        "pinocchio native": lambda: pinocchio(case, shipped=False),
        "mujoco": lambda: mujoco(case, folder),
    }

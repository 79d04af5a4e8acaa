"""SymPy's Kane equations, printed by SymPy's cse and C printer or by pydy: a process of its own, as it may not end.

Run as ``python -m benchmarks.kane CASE sympy|pydy FILE``: writes the C text to FILE and prints the CPU seconds.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import sympy as sp
from sympy.physics import mechanics as me
from sympy.printing.c import C99CodePrinter

from benchmarks.cases import Case, case


def _equations(given: Case) -> tuple[Any, Any, list[Any], list[Any], dict[str, Any]]:
    """M, f (without Q), q, u and the parameters"""
    n = given.n
    q, u = (list(me.dynamicsymbols(" ".join(f"{x}{i}" for i in range(n)) + " ", real=True)) for x in "qu")
    p = {name: sp.Symbol(name) for name in given.values}
    N, O = me.ReferenceFrame("N"), me.Point("O")  # noqa: E741
    O.set_vel(N, 0)
    bodies, loads = (_rods if given.planar else _segments)(given, q, u, p, N, O)
    kinematic = [a - b.diff() for a, b in zip(u, q, strict=True)]
    kane = me.KanesMethod(N, q_ind=q, u_ind=u, kd_eqs=kinematic)
    kane.kanes_equations(bodies, loads)
    return kane.mass_matrix, kane.forcing, q, u, p


def _rods(
    given: Case,
    q: list[Any],
    u: list[Any],
    p: dict[str, Any],
    N: Any,
    O: Any,  # noqa: E741
) -> tuple[list[Any], list[Any]]:
    o = given.offset
    place = sum((a * b for a, b in zip(q[:o], (N.x, N.y), strict=False)), 0 * N.x)
    base = O.locatenew("base", place)
    base.set_vel(N, sum((a * b for a, b in zip(u[:o], (N.x, N.y), strict=False)), 0 * N.x))
    bodies: list[Any] = [me.Particle("cart", base, p["mc"])] if given.base == "cart" else []
    loads, frames, starts, ends = [], [], [], []
    for i, rod in enumerate(given.rods(p)):
        before = N if rod.parent < 0 or given.absolute else frames[rod.parent]
        frame = me.ReferenceFrame(f"B{i}")
        frame.orient_axis(before, before.z, q[o + i])
        frame.set_ang_vel(before, u[o + i] * before.z)
        start = base if rod.parent < 0 else (ends if rod.at_end else starts)[rod.parent]
        center = start.locatenew(f"G{i}", -sp.nsimplify(rod.center) * rod.length * frame.y)
        center.v2pt_theory(start, N, frame)
        end = start.locatenew(f"E{i}", -rod.length * frame.y)
        end.v2pt_theory(start, N, frame)
        bodies.append(me.RigidBody(f"L{i}", center, frame, rod.mass, (me.inertia(frame, 0, 0, rod.inertia), center)))
        loads.append((center, -rod.mass * p["g"] * N.y))
        frames.append(frame)
        starts.append(start)
        ends.append(end)
    return bodies, loads


def _segments(
    given: Case,
    q: list[Any],
    u: list[Any],
    p: dict[str, Any],
    N: Any,
    O: Any,  # noqa: E741
) -> tuple[list[Any], list[Any]]:
    bodies, loads, before, origin = [], [], N, O
    for i, link in enumerate(given.segments(p)):
        axes = (before.x, before.y, before.z)
        place = origin.locatenew(f"J{i}", sum((a * b for a, b in zip(link.place, axes, strict=True)), 0 * N.x))
        place.v2pt_theory(origin, N, before)
        frame = me.ReferenceFrame(f"B{i}")
        frame.orient_axis(before, axes[link.axis], q[i])
        frame.set_ang_vel(before, u[i] * axes[link.axis])
        offset = sum((a * b for a, b in zip(link.center, (frame.x, frame.y, frame.z), strict=True)), 0 * N.x)
        center = place.locatenew(f"G{i}", offset)
        center.v2pt_theory(place, N, frame)
        I = link.inertia  # noqa: E741
        tensor = me.inertia(frame, I[0][0], I[1][1], I[2][2], I[0][1], I[1][2], I[0][2])
        bodies.append(me.RigidBody(f"L{i}", center, frame, link.mass, (tensor, center)))
        loads.append((center, -link.mass * p["g"] * N.z))
        before, origin = frame, place
    return bodies, loads


class _Printer(C99CodePrinter):  # type: ignore[misc]
    """Symbols as entries of the arguments."""

    def __init__(self, places: dict[str, str]) -> None:
        super().__init__()
        self.places = places

    def _print_Symbol(self, symbol: Any) -> str:
        return self.places.get(symbol.name, symbol.name)


HEAD = "static void mass_and_forcing(const double q[], const double u[], const double p[], double M[], double f[])"


def _by_sympy(M: Any, f: Any, q: list[Any], u: list[Any], p: dict[str, Any]) -> str:
    n = len(q)
    plain = {a: sp.Symbol(f"{x}{i}") for x, v in (("u", u), ("q", q)) for i, a in enumerate(v)}
    places = {f"{x}{i}": f"{x}[{i}]" for x in "qu" for i in range(n)} | {name: f"p[{i}]" for i, name in enumerate(p)}
    upper = [M[i, j] for i in range(n) for j in range(i, n)]
    steps, results = sp.cse([e.xreplace(plain) for e in [*upper, *f]], symbols=sp.numbered_symbols("z_"), order="none")
    printer = _Printer(places)
    targets = [f"M[{i * n + j}]" for i in range(n) for j in range(i, n)] + [f"f[{i}]" for i in range(n)]
    lines = [f"    const double {name} = {printer.doprint(e)};" for name, e in steps]
    lines += [f"    {target} = {printer.doprint(e)};" for target, e in zip(targets, results, strict=True)]
    return f"{HEAD} {{\n" + "\n".join(lines) + "\n}\n"


def _by_pydy(M: Any, f: Any, q: list[Any], u: list[Any], p: dict[str, Any]) -> str:
    from pydy.codegen.c_code import CMatrixGenerator

    generator = CMatrixGenerator([q, u, list(p.values())], [M, f])
    _, source = generator.doprint()
    body = "\n".join(line for line in source.splitlines() if not line.startswith("#include"))
    return f"{body}\n{HEAD} {{ evaluate((double *)q, (double *)u, (double *)p, M, f); }}\n"


def main() -> None:
    """Derive and print one case."""
    name, printer, target = sys.argv[1:]
    if printer == "pydy":
        import pydy.codegen.c_code  # noqa: F401 (imports are not timed)
    start = time.process_time()
    text = (_by_pydy if printer == "pydy" else _by_sympy)(*_equations(case(name)))
    seconds = time.process_time() - start
    Path(target).write_text(text, "utf-8")
    print(seconds)


if __name__ == "__main__":
    main()

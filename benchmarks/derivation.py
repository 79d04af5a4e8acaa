"""The derivation of lag2fmu against its peers: speed of the accelerations and of what leads to them, with the targets.

Run with ``make bench`` or ``python -m benchmarks.derivation [CASE ...] [--quick] [--json FILE]``. All kernels of a case
are timed in turn in one process, over 64 states, by the thread's CPU clock; medians. Every kernel is checked first: the
residual |M qdd - f| against M and f written by hand. Peers that are not installed are reported.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.cases import Case, Floats, case
from benchmarks.entries import OURS, Entry, by_hand, methods, ours
from benchmarks.peers import MAX_OPERATIONS, peers
from benchmarks.running import (
    Kernel,
    Source,
    compile_kernel,
    derivative_error,
    residual,
    rows_of,
    time_interleaved,
)

CASES = ("P5", "P20", "P40", "P20a", "C8", "S6", "S7", "S12", "T14")
QUICK = ("P5", "C8", "S6")
LAGRANGIANS = ("casadi lagrangian", "casadi lagrangian ldl")
HAND_WRITTEN = ("aba by hand", "crba by hand")
PINOCCHIO = "pinocchio shipped"

TARGETS: Mapping[str, Mapping[str, float]] = {
    "ns / best casadi lagrangian": {"P20": 0.25, "C8": 0.45, "S6": 0.55, "S7": 0.55, "S12": 0.40},
    "ns / pinocchio shipped": {"P20": 0.12, "P40": 0.12, "C8": 0.11, "S6": 0.26, "S7": 0.28, "S12": 0.33},
    "ns / best by hand on our graph": {"P20": 1.05, "P40": 1.05, "C8": 1.1, "S6": 1.15, "S7": 1.15, "S12": 1.15},
    "operations of qdd": {"P20": 1720, "P40": 3500},
    "operations of M and f": {"C8": 570, "S6": 1735, "S7": 2180, "S12": 4770},
    "derive + generate / casadi lagrangian": {"P20": 0.25, "C8": 0.25, "S6": 0.25, "S7": 0.25, "S12": 0.25},
    "directional derivative / function": dict.fromkeys(CASES, 3.0),
}
"""From DERIVATION.md, and issue 3 for the derivative.

DERIVATION.md counts the operations of P for qdd by elimination, but those of C8 and S for M and f without the solution
(its row dag-subst-fp); each is compared with the same count here.
"""


@dataclass
class Row:
    """The measurements of one system in one case; None where there is none, and why in ``note``."""

    ns: float | None = None
    operations: int | None = None
    mass_operations: int | None = None
    derive_ms: float | None = None
    compile_s: float | None = None
    derivative_ns: float | None = None
    next_derivative_ns: float | None = None
    residual: float | None = None
    derivative_error: float | None = None
    note: str = ""
    extra: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Options:
    """``rounds`` of timing; ``repeats`` of derivations; ``limit`` in s of processes of their own; where files go."""

    rounds: int
    repeats: int
    limit: float
    folder: Path


# ------------------------------------------------------------------------------------------------------------ one case


def measure(given: Case, options: Options) -> dict[str, Row]:
    """{system: Row} of one case."""
    makers: dict[str, Callable[[], Entry]] = {}
    for method in methods():
        makers[f"{OURS} {method or 'automatic'}"] = lambda method=method: ours(given, method)
    makers |= {f"{algorithm} by hand": lambda a=algorithm: by_hand(given, a) for algorithm in ("aba", "crba")}
    makers |= peers(given, options.folder)
    makers |= {f"kane {p}": lambda p=p: _kane(given, p, options) for p in ("sympy", "pydy")}
    rows, entries = {label: Row() for label in makers}, {}
    for label, make in makers.items():
        try:
            entries[label] = make()
        except (ImportError, NotImplementedError, ValueError, RuntimeError, OSError) as error:
            rows[label].note = str(error)
    _time_derivations(entries, rows, options)
    _time_kernels(given, entries, rows, options)
    return rows


def _kane(given: Case, printer: str, options: Options) -> Entry:
    target = options.folder / f"{given.name}_{printer}.h"
    command = [sys.executable, "-m", "benchmarks.kane", given.name, printer, str(target)]
    if options.limit <= 0:
        raise NotImplementedError("not asked for")
    if printer == "pydy" and not (options.folder / f"{given.name}_sympy.h").exists():
        raise NotImplementedError("the same equations as 'kane sympy', which has not ended")
    target.unlink(missing_ok=True)
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=options.limit, check=False)
    except subprocess.TimeoutExpired:
        raise RuntimeError(f"not done after {options.limit:.0f} s") from None
    if done.returncode:
        raise ImportError((done.stderr.strip().splitlines() or ["no output"])[-1])
    return Entry(Source("kane.c", target.read_text("utf-8")), float(done.stdout))


def _time_derivations(entries: Mapping[str, Entry], rows: Mapping[str, Row], options: Options) -> None:
    """Medians over interleaved repetitions; systems that are derived once keep that time."""
    seconds = {label: [] if entry.repeat else [entry.seconds] for label, entry in entries.items()}
    for _ in range(options.repeats):
        for label, entry in entries.items():
            if entry.repeat is not None:
                seconds[label].append(entry.repeat())
    for label, entry in entries.items():
        row = rows[label]
        row.derive_ms = 1e3 * float(np.median(seconds[label]))
        row.operations, row.mass_operations = entry.operations, entry.mass_operations
        row.note, row.extra = entry.note, dict(entry.extra)


def _time_kernels(given: Case, entries: Mapping[str, Entry], rows: Mapping[str, Row], options: Options) -> None:
    table = rows_of(given)
    kernels: dict[str, Kernel] = {}
    for label, entry in entries.items():
        row = rows[label]
        try:
            _compile_entry(given, label, entry, row, kernels, table, options)
        except subprocess.CalledProcessError as error:
            row.note = f"compiler: {(error.stderr or '').strip()[-200:]}"
        except (AssertionError, OSError, RuntimeError) as error:
            row.note = str(error)
    time_interleaved(kernels, table, given.n, options.rounds)
    for label, kernel in kernels.items():
        system, _, kind = label.partition(" | ")
        setattr(rows[system], kind, kernel.median)


def _compile_entry(
    given: Case,
    label: str,
    entry: Entry,
    row: Row,
    kernels: dict[str, Kernel],
    table: Floats,
    options: Options,
) -> None:
    """Compile and check the kernels of ``entry``; raises AssertionError if one is wrong."""
    length = entry.mass_operations if entry.source.kernel.endswith("_mass.c") else entry.operations
    if (length or 0) > MAX_OPERATIONS:
        row.note = f"{length} operations: not compiled"
        return
    main = compile_kernel(given, entry.source, options.folder, label)
    row.compile_s = main.compile_seconds
    _, qdd = main.run(table, given.n, 1)
    row.residual = residual(given, table, qdd)
    if entry.source.tolerance is not None and not row.residual <= entry.source.tolerance:
        raise AssertionError(f"wrong: residual {row.residual:.1e} > {entry.source.tolerance:.0e}")
    kernels[f"{label} | ns"] = main
    for source, kind in ((entry.derivative, "derivative_ns"), (entry.next_derivative, "next_derivative_ns")):
        if source is None or (entry.derivative_operations or 0) > MAX_OPERATIONS:
            continue
        kernel = compile_kernel(given, source, options.folder, f"{label} {kind}")
        if source.tolerance is not None:
            row.derivative_error = derivative_error(given, table, main, kernel.run(table, given.n, 1)[1])
            if not row.derivative_error <= 1e-5:
                row.note = f"wrong derivative: {row.derivative_error:.1e} from differences"
                continue
        kernels[f"{label} | {kind}"] = kernel


# -------------------------------------------------------------------------------------------------------------- tables

Results = Mapping[str, Mapping[str, Row]]
"""{case: {system: Row}}"""


def _best(rows: Mapping[str, Row], labels: tuple[str, ...], quantity: str = "ns") -> float | None:
    found = [value for label in labels if (value := getattr(rows.get(label, Row()), quantity)) is not None]
    return min(found) if found else None


def _ratio(a: float | None, b: float | None) -> float | None:
    return a / b if a is not None and b else None


def reached(rows: Mapping[str, Row]) -> dict[str, float | None]:
    """The quantities of TARGETS, by lag2fmu's own choice of method."""
    mine = rows[f"{OURS} automatic"]
    return {
        "ns / best casadi lagrangian": _ratio(mine.ns, _best(rows, LAGRANGIANS)),
        "ns / pinocchio shipped": _ratio(mine.ns, _best(rows, (PINOCCHIO,))),
        "ns / best by hand on our graph": _ratio(mine.ns, _best(rows, HAND_WRITTEN)),
        "operations of qdd": mine.operations,
        "operations of M and f": mine.mass_operations,
        "derive + generate / casadi lagrangian": _ratio(mine.derive_ms, _best(rows, LAGRANGIANS, "derive_ms")),
        "directional derivative / function": _ratio(mine.derivative_ns, mine.ns),
    }


def _cell(row: Row, quantity: str, reference: float | None) -> str:
    value = getattr(row, quantity)
    if value is None:
        return ""
    text = str(value) if isinstance(value, int) else f"{value:.3g}" if value < 100 else f"{value:.0f}"
    return f"{text} ({value / reference:.2f})" if reference else text


def _tables(results: Results) -> Iterator[Table]:
    quantities = {
        "ns": "accelerations, ns a call (ratio to pinocchio as shipped)",
        "operations": "operations of the accelerations",
        "mass_operations": "operations of M and f, where they are written out",
        "derive_ms": "derive + generate C, CPU ms (ratio to casadi lagrangian)",
        "compile_s": "compile, CPU s",
        "derivative_ns": "directional derivative, ns (ratio to the system's own accelerations; ours with qdd known)",
        "next_derivative_ns": "directional derivative along a further seed, ns (ratio to the accelerations)",
    }
    for quantity, title in quantities.items():
        table = Table(title=title, title_justify="left")
        table.add_column("")
        for name in results:
            table.add_column(name, justify="right")
        for system in next(iter(results.values())):
            cells = []
            for rows in results.values():
                reference = {
                    "ns": rows[PINOCCHIO].ns,
                    "derive_ms": rows[LAGRANGIANS[0]].derive_ms,
                    "derivative_ns": rows[system].ns,
                    "next_derivative_ns": rows[system].ns,
                }.get(quantity)
                cells.append(_cell(rows[system], quantity, reference))
            if any(cells):
                table.add_row(system, *cells)
        yield table


def _targets_table(results: Results) -> Table:
    table = Table(title="targets: measured / target, of lag2fmu's own choice", title_justify="left")
    table.add_column("")
    for name in results:
        table.add_column(name, justify="right")
    values = {name: reached(rows) for name, rows in results.items()}
    for quantity, targets in TARGETS.items():
        cells = []
        for name in results:
            value, target = values[name][quantity], targets.get(name)
            shown = "" if value is None else f"{value:.0f}" if value > 100 else f"{value:.2f}"
            if value is not None and target is not None:
                verdict = "reached" if value <= target else f"missed by {100 * (value / target - 1):.0f} %"
                shown += f" / {target:g} {verdict}"
            cells.append(shown)
        table.add_row(quantity, *cells)
    return table


def _report(results: Results, console: Console) -> None:
    for table in _tables(results):
        console.print(table)
    console.print(_targets_table(results))
    for name, rows in results.items():
        for system, row in rows.items():
            extra = ", ".join(f"{key} {1e3 * seconds:.0f} ms" for key, seconds in row.extra.items())
            remark = "; ".join(text for text in (row.note, extra) if text)
            if remark:
                console.print(f"{name}, {system}: {remark}", highlight=False, markup=False)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("cases", nargs="*", metavar="CASE", help=f"default: {' '.join(CASES)}")
    parser.add_argument("--quick", action="store_true", help=f"{' '.join(QUICK)}, few rounds, no Kane equations")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the measurements as JSON")
    parser.add_argument("--limit", type=float, default=60.0, help="seconds after which Kane equations are given up")
    parser.add_argument("--folder", type=Path, help="where compiled files stay; Pinocchio is then compiled only once")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="lag2fmu-bench-") as temporary:
        folder = given.folder or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        rounds, repeats, limit = (7, 3, 0.0) if given.quick else (21, 5, given.limit)
        options = Options(rounds, repeats, limit, folder.resolve())
        results: dict[str, dict[str, Row]] = {}
        for name in given.cases or (QUICK if given.quick else CASES):
            print(f"{name} ...", file=sys.stderr, flush=True)
            results[name] = measure(case(name), options)
    _report(results, Console(width=None if sys.stdout.isatty() else 200))
    if given.json:
        measured = {name: {system: vars(row) for system, row in rows.items()} for name, rows in results.items()}
        summary = {name: reached(rows) for name, rows in results.items()}
        given.json.write_text(json.dumps({"measured": measured, "summary": summary}, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()

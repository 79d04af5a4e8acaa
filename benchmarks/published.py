"""Published benchmark problems of multibody dynamics, run as one who meets lag2fmu for the first time would.

Run with `make published` or `python -m benchmarks.published [PROBLEM ...]`. Each problem is written as text, in
benchmarks/problems, or comes along. `lag2fmu export` makes the FMU and `lag2fmu simulate` runs it by fmpy, with the
default solver at the default tolerance of 1e-6. Beside each number stands what it should be: the published value where
there are digits, a closed form, or the independent path of lag2fmu, which integrates the energies of the mechanism and
knows nothing of the FMU. CPU time is that of fmpy and the FMU for a run, with loading.

The tolerance bounds the error of a step, and errors of steps add up: over ten swings to about a hundred times the
tolerance, which misses three of the bars. Each problem then says what meets them. Of the spatial slider-crank the
solutions that were submitted differ from each other by 8e-4 m. Of Bricard's mechanism
and the governor the library's own tables are not at hand, so the independent path stands for them, and what is drawn of
the tables is held by a test.
"""

from __future__ import annotations

import argparse
import datetime
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

from benchmarks import nonsmooth
from benchmarks.all import processor
from benchmarks.library import PROBLEMS, Number, Result
from benchmarks.published_values import ENTRIES
from benchmarks.results_files import written
from benchmarks.stranger import DEFAULT, Asked
from lag2fmu.version import VERSION

OUT = Path(__file__).parent.parent / "docs" / "published.md"
RESULTS = Path(__file__).parent.parent / "build" / "published"
OTHERS = [Asked("dop853"), *(Asked(None, 10.0**-k) for k in range(7, 13))]
"""What is asked for where the default misses a bar: until it is met, first the solver, then tighter tolerances."""


def main() -> None:
    """Run the problems, print them, and write the page and the files for the library; exit with 1 if one fails."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="PROBLEM", help=f"default: {' '.join(PROBLEMS)}")
    names = parser.parse_args().names
    unknown = sorted({*names} - {*PROBLEMS})
    if unknown:
        parser.error(f"there is no problem '{unknown[0]}'; there are {', '.join(PROBLEMS)}")
    sections = []
    for name in names or PROBLEMS:
        title, problem = PROBLEMS[name]
        print(f"== {title}", flush=True)
        found = {DEFAULT: problem(DEFAULT)}
        if not all(number.met for number in found[DEFAULT].numbers):
            found |= met_by(problem)
        sections.append(section(name, title, found))
        print(sections[-1], flush=True)
        written(name, found, RESULTS)
    if not names:
        sections.append(nonsmooth.section([*nonsmooth.PROBLEMS]))
        OUT.write_text(page(sections), "utf-8", newline="\n")
        print(f"wrote {OUT}")


def met_by(problem: Callable[[Asked], Result]) -> dict[Asked, Result]:
    """What meets all bars, of OTHERS: the other solver where it does, and the loosest tolerance."""
    found = {}
    for asked in OTHERS:
        result = problem(asked)
        if all(number.met for number in result.numbers):
            found[asked] = result
            if asked.tolerance is not None:
                break
    return found


def section(name: str, title: str, found: dict[Asked, Result]) -> str:
    """A problem in Markdown: its numbers by the default, CPU times, and what else meets its bars."""
    lines = [f"## {title}", "", "| what | lag2fmu | should be | error | bar | met |", "|---|---|---|---|---|---|"]
    lines += [row(number) for number in found[DEFAULT].numbers]
    seconds = found[DEFAULT].seconds
    times = [] if seconds is None else [f"CPU time of the run: {1000 * seconds:.0f} ms."]
    times += [f"Of others: {ENTRIES[name]}."] if name in ENTRIES else []
    lines += ["", " ".join(times)] if times else []
    if not all(number.met for number in found[DEFAULT].numbers):
        others = [
            f"`{asked}` ({1000 * (result.seconds or 0):.0f} ms)" for asked, result in found.items() if asked != DEFAULT
        ]
        lines += [
            "",
            f"The default misses a bar. All bars are met by {' and by '.join(others) or 'none of what was tried'}.",
        ]
    return "\n".join(lines) + "\n"


def row(number: Number) -> str:
    """A line of the table."""
    what = f"{number.what}; {number.remark}" if number.remark else number.what
    bar, met = ("", "") if number.bar is None else (f"{number.bar:g}", "yes" if number.met else "**no**")
    return f"| {what} | {number.ours} | {number.published} | {number.error:.1e} | {bar} | {met} |"


def page(sections: Iterable[str]) -> str:
    """The whole page."""
    day = datetime.datetime.now(datetime.timezone.utc).date()
    prose = "\n\n".join(" ".join(part.split()) for part in (__doc__ or "").split("\n\n")[1:])
    head = (
        f"# Published benchmark problems\n\nMade by `make published` with lag2fmu {VERSION} on {day}: {processor()}, "
    )
    return head + f"Python {sys.version.split()[0]}.\n\n{prose}\n\n" + "\n".join(sections)


if __name__ == "__main__":
    main()

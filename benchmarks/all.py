"""All measurements in turn, their tables and pictures in docs/benchmarks.md with the name of the processor.

Run with `make bench` or `python -m benchmarks.all [NAME ...]`; with names only these run, and no file is written. The
whole takes about half an hour of a machine that does nothing else. Peers come with
`pip install -e ".[bench,sweeps]"`; those that are missing are named in the tables.
"""

from __future__ import annotations

import argparse
import ast
import datetime
import os
import platform
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from lag2fmu.version import VERSION

ROOT = Path(__file__).parent.parent
OUT = ROOT / "docs" / "benchmarks.md"
PICTURES = OUT.parent / "assets" / "benchmarks"
BENCHMARKS: dict[str, bool] = {
    "export": False,
    "waiting": False,
    "stepping": False,
    "adjoints": False,
    "robots": False,
    "constraints": False,
    "contacts": False,
    "impacts": False,
    "dropped_boxes": False,
    "repeating": False,
    "ensembles": False,
    "sweeps": False,
    "sensitivities": False,
    "calibration": False,
    "integrators": True,
    "long": True,
    "derivation": False,
}
"""Module of this folder -> whether it draws pictures; their names begin with its name."""


def main() -> None:
    """Run the benchmarks and write their tables; exit with 1 if one of them fails."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"default: {' '.join(BENCHMARKS)}")
    names = parser.parse_args().names
    unknown = sorted({*names} - {*BENCHMARKS})
    if unknown:
        parser.error(f"there is no benchmark '{unknown[0]}'; there are {', '.join(BENCHMARKS)}")
    sections, failed = [], []
    for name in names or BENCHMARKS:
        code, text = _run(name, PICTURES if not names else ROOT / "build" / "benchmarks")
        failed += [name] if code else []
        sections.append(_section(name, text if code == 0 else f"{text}\nended with exit code {code}"))
    if not names:
        OUT.write_text(f"{_head()}\n{''.join(sections)}", "utf-8", newline="\n")
        print(f"wrote {OUT.relative_to(ROOT)}")
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


def _run(name: str, pictures: Path) -> tuple[int, str]:
    """The exit code of a benchmark and what it printed, which is shown while it runs; its pictures go to a folder."""
    print(f"== {name}", flush=True)
    command = [sys.executable, "-m", f"benchmarks.{name}"]
    command += ["--folder", str(pictures)] if BENCHMARKS[name] else []
    environment = os.environ | {"COLUMNS": "150", "PYTHONIOENCODING": "utf-8", "PYTHONUNBUFFERED": "1"}
    lines = []
    with subprocess.Popen(
        command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True, encoding="utf-8"
    ) as process:
        for line in process.stdout or ():
            print(line, end="", flush=True)
            lines.append(line.rstrip())
    return process.returncode, "\n".join(lines).strip("\n")


def _section(name: str, text: str) -> str:
    """A section of the file: what is measured, as the module says, the tables and the pictures."""
    module = ast.parse((Path(__file__).parent / f"{name}.py").read_text("utf-8"))
    title, *paragraphs = (ast.get_docstring(module) or name).split("\n\n")
    pictures = sorted(PICTURES.glob(f"{name}*.svg")) if BENCHMARKS[name] else []
    shown = "".join(f"\n![{picture.stem}]({picture.relative_to(OUT.parent).as_posix()})\n" for picture in pictures)
    return f"\n## {title.rstrip('.')}\n\n{_prose(paragraphs)}\n\n```text\n{text}\n```\n{shown}"


def _prose(paragraphs: Iterable[str]) -> str:
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in paragraphs)


def _head() -> str:
    """Title, and the machine and versions that the numbers belong to."""
    facts = [processor(), f"{os.cpu_count()} processors", platform.platform(), f"Python {platform.python_version()}"]
    day = datetime.datetime.now(datetime.timezone.utc).date()
    return f"# Measurements\n\nMade by `make bench` with lag2fmu {VERSION} on {day}: {', '.join(facts)}.\n"


def processor() -> str:
    """The name of the processor, as the system has it."""
    table = Path("/proc/cpuinfo")
    lines = table.read_text("utf-8", "replace").splitlines() if table.is_file() else []
    named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.processor() or platform.machine()


if __name__ == "__main__":
    main()

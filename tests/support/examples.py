"""The examples of a page in Markdown: its fenced blocks, run one after the other as a reader would run them.

``console`` holds lines ``$ command`` and what they print below; ``python`` is run, all blocks of a page as one program,
and a ``text`` block right after it is what it prints; ``toml`` is read, and is written to a file if it has a
``title="..."``, as any block is that has one. In what is printed "..." stands for anything. Blocks of other languages
are not run, and a test asserts that they hold no command of lag2fmu.
"""

from __future__ import annotations

import re
import shlex
import textwrap
from contextlib import redirect_stdout
from doctest import ELLIPSIS, NORMALIZE_WHITESPACE, OutputChecker
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

from click.testing import CliRunner

from lag2fmu.cli import main
from lag2fmu.formats.text import read

_FENCE = re.compile(r"^(?P<indent> *)```(?P<language>\w+)(?P<rest>[^\n`]*)\n(?P<text>.*?)^(?P=indent)```", re.M | re.S)
_TITLE = re.compile(r'title="([^"]+)"')
_FLAGS = ELLIPSIS | NORMALIZE_WHITESPACE


class Block(NamedTuple):
    """A fenced block: its ``language``, its ``text``, the name of its file ("": none), and its line in the page."""

    language: str
    text: str
    file: str
    line: int


def blocks(page: Path) -> list[Block]:
    """The fenced blocks of ``page`` in their order."""
    content = page.read_text("utf-8")
    found = []
    for match in _FENCE.finditer(content):
        title = _TITLE.search(match["rest"])
        line = content.count("\n", 0, match.start()) + 1
        found.append(Block(match["language"], textwrap.dedent(match["text"]), title[1] if title else "", line))
    return found


def run(page: Path, folder: Path) -> None:
    """Run the examples of ``page`` in ``folder``, which is the current one; AssertionError names page and line."""
    names: dict[str, Any] = {"__name__": "example"}
    found = blocks(page)
    for block, after in zip(found, [*found[1:], None], strict=True):
        where = f"{page.name}, line {block.line}"
        if block.file:
            (folder / block.file).write_text(block.text, "utf-8")
        if block.language == "console":
            _console(block.text, folder, where)
        elif block.language == "toml" and "[mechanism]" in block.text:
            read(block.text, str(folder / (block.file or "example.toml")))
        elif block.language == "python" and not block.file:
            printed = StringIO()
            with redirect_stdout(printed):
                exec(compile(block.text, where, "exec"), names)
            if after is not None and after.language == "text":
                _compare(after.text, printed.getvalue(), where)


def _console(text: str, folder: Path, where: str) -> None:
    """Run the commands; what is printed is compared where anything stands below a command."""
    for part in re.split(r"^\$ ", text, flags=re.M)[1:]:
        line, _, expected = part.partition("\n")
        command, _, target = line.partition(" > ")
        program, *arguments = shlex.split(command, comments=True)
        assert program == "lag2fmu", f"{where}: only commands of lag2fmu can be run"
        done = CliRunner().invoke(main, arguments)
        assert done.exit_code == 0, f"{where}: {line}\n{done.output}{done.exception!r}"
        if target:
            (folder / target).write_text(done.stdout, "utf-8")
        if expected.strip():
            _compare(expected, done.output, f"{where}: {line}")


def _compare(expected: str, printed: str, where: str) -> None:
    assert OutputChecker().check_output(expected, printed, _FLAGS), f"{where} prints\n{printed}\nand not\n{expected}"

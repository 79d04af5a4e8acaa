"""What type checkers and editors are told of ``Mechanism`` is what it takes."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

from lag2fmu.description.description import Description, table_keys
from lag2fmu.mechanism import Mechanism
from lag2fmu.mechanism.keywords import Keywords

ROOT = Path(__file__).parents[2]
USE = """
from lag2fmu import Mechanism
from lag2fmu.mechanism import Body, Energy, coordinate

x = coordinate("x", "m")
Mechanism("right", coordinates=[x], bodies=[Body("ball", 1, position=[x, 0])], gravity=9.81, forces={x: -x})
Mechanism("wrong", bodys=[])
Mechanism("wrong", bodies=[Energy()])
Mechanism("wrong", title=3)
"""


def test_keywords_are_the_tables_of_a_description() -> None:
    hints = {name: set(re.findall(r"\w+", hint.__forward_arg__)) for name, hint in Keywords.__annotations__.items()}
    assert list(hints) == [item.name for item in fields(Description) if item.name != "name"]
    for name, table in table_keys().items():
        assert table.part.__name__ in hints[name], name


def test_each_keyword_is_explained() -> None:
    assert [name for name in Keywords.__annotations__ if f"``{name}``" not in str(Mechanism.__init__.__doc__)] == []


def test_a_type_checker_finds_wrong_keywords_and_parts(tmp_path: Path) -> None:
    """With the settings of 'make lint', whose cache has what the package says of its types."""
    (tmp_path / "use.py").write_text(USE, "utf-8")
    settings = [f"--config-file={ROOT / 'pyproject.toml'}", f"--cache-dir={ROOT / '.mypy_cache'}"]
    command = [sys.executable, "-m", "mypy", *settings, "use.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    lines = [line.split(": ", 2)[:2] for line in done.stdout.splitlines() if "error" in line and line.startswith("use")]
    assert lines == [[f"use.py:{number}", "error"] for number in (7, 8, 9)], done.stdout

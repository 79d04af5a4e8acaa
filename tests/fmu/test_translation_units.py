"""Which C files are compiled as one unit."""

import re

import pytest
from describing import described

from lag2fmu.fmu.units import units
from lag2fmu.formats.loading import load

HEADER = '#include "shared.h"\n'
FIRST = (
    HEADER + "enum { N = 3, ROUNDING };\nstatic int add(int a) { return a + N; }\nint first(int a) { return add(a); }\n"
)


def together(second: str) -> bool:
    """Whether a file with the text ``second`` stands in one unit with FIRST."""
    return len(units({"first.c": FIRST, "second.c": HEADER + second, "shared.h": "int first(int a);\n"})) == 1


@pytest.mark.parametrize(
    "second",
    [
        "static double add(double a) { return a; }\n",
        "int second(int add) { return add; }\n",
        "enum { M = 2, N = 4 };\n",
        "#define ROUNDING 1e-9\n",
        "#  define first second\n",
        "static const double ROUNDING = 1e-9;\n",
        "typedef struct {\n    int a;\n} N;\n",
        "struct add { int a; };\n",
        "typedef int (*second)(int a);\nstatic int first = 2;\n",
    ],
)
def test_names_of_one_file_keep_others_apart(second: str) -> None:
    assert not together(second)


@pytest.mark.parametrize(
    "second",
    [
        "int second(int a) { return first(a); }\n",
        "static int subtract(int a) { return first(a); } /* add, N and ROUNDING are spoken of only */\n",
        'int second(void) { return first(sizeof "add N"); } // add\n',
    ],
)
def test_files_without_such_names_stand_together(second: str) -> None:
    assert together(second)


def test_functions_of_headers_keep_files_apart() -> None:
    """A header declares a name of the other file, even where the file that includes it does not speak of it."""
    headers = {
        "outer.h": '#include "inner.h"\n',
        "inner.h": "int add(int a, int b);\n",
        "shared.h": "int first(int a);\n",
    }
    second = '#include "outer.h"\nint second(void) { return 2; }\n'
    assert len(units({"first.c": FIRST, "second.c": second, **headers})) == 2


@pytest.mark.parametrize("model", ["pendulum", "whipple_bicycle", "woodpecker"])
def test_each_file_stands_in_one_unit(model: str) -> None:
    _, sources = described(load(model))
    joined = units(sources)
    stands = [file for text in joined.values() for file in re.findall(r'#include "(.*)"', text)]
    assert sorted(stands) == sorted(file for file in sources if file.endswith(".c"))
    assert len(joined) < len(stands) / 2

"""Which C files are compiled as one unit."""

import ctypes
import re
import subprocess

import pytest
from describing import described

from lag2fmu.fmu.compilers import compiler_command
from lag2fmu.fmu.units import units
from lag2fmu.formats.loading import load

OWN = {
    "add.c": "static int own(int a) { return a + 1; }\nint add(int a) { return own(a); }\n",
    "callback.c": "typedef int (*own)(int);\nint callback(own take, int a) { return take(a); }\n",
    "constant.c": "static const int own = 8;\nint constant(void) { return own; }\n",
    "enumeration.c": "enum { OTHER = 30, own = 3 };\nint enumeration(void) { return own; }\n",
    "field.c": "struct own { int own; };\nint field(int a) { struct own s = {2 * a}; return s.own; }\n",
    "local.c": "int local(int own) { return own - 1; } /* static int own(void); */\n",
    "macro.c": "#define own 4\nint macro(void) { return own; }\n",
    "of_header.c": '#include "type.h"\nint of_header(own a) { return (int)sizeof a; }\n',
    "other.c": "static int own(int a) { return a + 5; }\nint other(int a) { return own(a); }\n",
    "record.c": "typedef struct {\n    int a;\n} own;\nint record(own *s) { return s->a; }\n",
    "spaced.c": "#  define own 6\nint spaced(void) { return own; }\n",
    "type.h": "#ifndef TYPE_H\n#define TYPE_H\ntypedef struct { char own[7]; } own;\n#endif\n",
}
"""Files that mean something else by one name each."""
HEADER = '#include "shared.h"\n'
FIRST = HEADER + "static int add(int a) { return a + 3; }\nint first(int a) { return add(a); }\n"


def together(second: str, shared: str = "int first(int a);\n") -> bool:
    """Whether a file with the text ``second`` stands in one unit with FIRST."""
    return len(units({"first.c": FIRST, "second.c": HEADER + second, "shared.h": shared})) == 1


def test_files_keep_names_of_their_own_in_one_unit(tmp_path) -> None:
    joined = units(OWN)
    assert len(joined) == 1
    for file, text in (OWN | joined).items():
        (tmp_path / file).write_text(text, "utf-8")
    command = [*compiler_command("zig", "native"), "-O2", "-shared", "-fPIC", *joined, "-o", "library"]
    subprocess.run(command, cwd=tmp_path, check=True)
    library = ctypes.CDLL(str(tmp_path / "library"))
    called = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int)(lambda a: a * a)
    assert (library.add(1), library.callback(called, 3), library.constant(), library.enumeration()) == (2, 9, 8, 3)
    assert (library.field(2), library.local(1), library.macro(), library.other(1)) == (4, 0, 4, 6)
    assert (library.record(ctypes.byref(ctypes.c_int(5))), library.spaced()) == (5, 6)


def test_names_without_namesakes_stand_as_they_are() -> None:
    (unit,) = units(
        {"first.c": FIRST, "second.c": HEADER + "int second(int a) { return first(a); } /* add */\n"}
    ).values()
    assert unit == '#include "first.c"\n#include "second.c"\n'


def test_a_name_in_a_header_of_the_file_keeps_others_apart() -> None:
    """There it may be a field, which all files of the unit share."""
    shared = "typedef struct { int add; } Sum;\nint first(int a);\n"
    assert not together("int second(Sum s) { return s.add; }\n", shared)
    assert together("int second(int a) { return first(a); }\n", shared)


@pytest.mark.parametrize("model", ["pendulum", "whipple_bicycle", "woodpecker"])
def test_each_file_stands_in_one_unit(model: str) -> None:
    _, sources = described(load(model))
    joined = units(sources)
    stands = [file for text in joined.values() for file in re.findall(r'#include "(.*)"', text)]
    assert sorted(stands) == sorted(file for file in sources if file.endswith(".c"))
    assert len(joined) <= len(stands) / 10 + 2

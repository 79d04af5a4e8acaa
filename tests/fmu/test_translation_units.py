"""Which C files are compiled as one unit."""

import re

import pytest
import sympy as sp
from describing import described

from lag2fmu.fmu.translation_units import MOST, shared_files, translation_units
from lag2fmu.formats.loading import load
from lag2fmu.mechanism import Body, Mechanism, coordinate


def test_units_include_files_as_they_are() -> None:
    sources = {"two.c": "int two(void);", "one.c": "int one(void);", "one.h": "int one(void);"}
    assert translation_units(sources) == {"unit_1.c": '#include "one.c"\n#include "two.c"\n'}


@pytest.mark.usefixtures("optimised")
def test_long_files_stand_apart() -> None:
    """And what still fits in the first unit joins it."""
    joined = translation_units({"a.c": " " * (MOST - 10), "b.c": " " * 20, "c.c": " " * 10})
    assert list(joined.values()) == ['#include "a.c"\n#include "c.c"\n', '#include "b.c"\n']


@pytest.mark.parametrize("model", ["pendulum", "whipple_bicycle", "woodpecker"])
def test_each_file_stands_in_one_unit(model: str) -> None:
    _, sources = described(load(model))
    joined = translation_units(sources)
    stands = [file for text in joined.values() for file in re.findall(r'#include "(.*)"', text)]
    assert sorted(stands) == sorted(file for file in sources if file.endswith(".c"))
    assert len(joined) <= len(stands) / 10 + 3


@pytest.mark.usefixtures("optimised")
def test_a_stage_of_the_solver_stands_in_one_unit() -> None:
    """And what is generated stands in units without files of the engine."""
    _, sources = described(load("double_pendulum"))
    units = [set(re.findall(r'#include "(.*)"', text)) for text in translation_units(sources).values()]
    stage = {"integrator.c", "runge_kutta.c", "tableau.c", "derivative.c", "constraints_none.c", "mass_matrix.c"}
    assert stage <= units[0]
    generated = {"mechanism.c", "derivatives.c", "second_derivatives.c", "locals_derivatives.c", "tables.c"}
    assert generated in units


@pytest.mark.usefixtures("optimised")
def test_mechanisms_of_one_kind_and_size_share_what_is_compiled_of_the_engine() -> None:
    """A name, values and a motion that differ stand in generated units, which nothing shares."""
    shared = []
    for name, length in (("one", 1.0), ("other", 2.0)):
        theta = coordinate("theta", "rad", start=0.1 * length)
        bob = Body("bob", 1.0, (length * sp.sin(theta), -length * sp.cos(theta)))
        _, sources = described(Mechanism(name, coordinates=[theta], bodies=[bob], gravity=9.81))
        units = translation_units(sources)
        files = {**sources, **units}
        shared.append({unit: found for unit in units if (found := shared_files(unit, files)) is not None})
        assert 0 < len(shared[-1]) < len(units)
    assert shared[0] == shared[1]
    assert {"integrator.c", "fmi2_common.c", "mechanism.h"} <= {name for found in shared[0].values() for name in found}


@pytest.mark.usefixtures("optimised")
def test_mechanisms_of_other_sizes_share_the_laws_of_contact() -> None:
    shared = []
    for name in ("bouncing_ball", "woodpecker"):
        _, sources = described(load(name))
        units = translation_units(sources)
        files = {**sources, **units}
        found = (shared_files(unit, files) for unit in units)
        shared.append([set(texts.items()) for texts in found if texts is not None and "laws.c" in texts])
        assert len(shared[-1]) == 1
    assert shared[0] == shared[1]

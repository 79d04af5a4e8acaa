"""Every bundled mechanism: its FMU against the direct integration, with the tolerance it declares and a sharp one."""

from __future__ import annotations

import filecmp
from functools import cache
from importlib import import_module

import pytest
from chosen import KINDS, SENSITIVE, kind_of
from describing import described

import lag2fmu
from lag2fmu.codegen import DEFAULT_SOLVER, SMOOTH_METHODS
from lag2fmu.fmu import export, read_mechanism
from lag2fmu.formats.loading import bundled, load
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.mechanism import Mechanism
from lag2fmu.reference import Reference, integrate

pytestmark = pytest.mark.fmu

FAMILIES = [
    ("n_pendulum", {"n": "1"}),
    ("n_pendulum", {"n": "5", "relative": "true"}),
    ("n_pendulum", {"n": "3", "frames": "true"}),
    ("coupled_masses", {"n": "9"}),
    ("particles", {"n": "5"}),
]
IN_TIME = FAMILIES[1:3]
"""Those that 'make test' compares; it compares the first member of every family."""


UNDECIDED = frozenset(("newtons_cradle",))
"""Balls that touch pass elastic impacts on: which pair collides first is decided by rounding, and runs part at once.
tests/gallery/test_impacts.py has closed forms."""


HYBRID = frozenset(
    {
        *("backlash_slider_crank", "block_on_belt", "brake", "braked_wheel", "clutch_pair", "crane", "falling_rod"),
        *("hopper_leg", "impact_oscillator", "pendulum_with_stop", "rocking_block", "sliding_sphere"),
        *("stack_of_blocks", "woodpecker"),
    }
)
"""Compared in 'make test-all': their closed forms in tests/gallery stand for them in 'make test'."""
OF_EACH_KIND = frozenset(("rk4", "radau5", "verlet"))
"""Solvers that 'make test' compares beside the default: of fixed steps, implicit, variational."""
COMPARED = [name for name in bundled() if name not in UNDECIDED]


@pytest.mark.parametrize(
    "model", [pytest.param(name, marks=pytest.mark.all_models) if name in HYBRID else name for name in COMPARED]
)
def test_the_fmu_agrees_with_the_direct_integration(model: str, exported) -> None:
    """As an FMU that ``validate`` makes of a model; in 'make test-all' with the libraries that users get."""
    report = lag2fmu.validate(exported(model, solver=None))
    assert report.passed, str(report)
    assert not any("Errors may grow" in note for note in report.notes), "the bundled starts are compared until the end"


@pytest.mark.slow
def test_every_kind_of_model_is_among_the_chosen() -> None:
    assert {kind_of(model) for model in bundled()} == {kind_of(model) for model in KINDS}


@pytest.mark.slow
@pytest.mark.parametrize("model", sorted(SENSITIVE))
def test_the_fmu_agrees_at_a_sharp_tolerance(model: str, exported) -> None:
    """tests/fmu/test_accuracy.py has all other smooth ones at 1e-10, and tests/gallery sharp bars for hybrid ones."""
    report = lag2fmu.validate(exported(model), tolerance=1e-10)
    assert report.passed, str(report)


@pytest.mark.parametrize(
    ("model", "arguments"),
    [case if case in IN_TIME else pytest.param(*case, marks=pytest.mark.slow) for case in FAMILIES],
)
def test_members_of_families_agree(model: str, arguments: dict[str, str], exported) -> None:
    report = lag2fmu.validate(exported(model, optimised=True, **arguments))
    assert report.passed, str(report)


@cache
def integrated_once(mechanism: Mechanism, times: tuple[float, ...], rtol: float) -> Reference:
    return integrate(mechanism, times, rtol=rtol)


@pytest.mark.parametrize(
    "solver",
    [
        pytest.param(name, marks=() if name in OF_EACH_KIND else pytest.mark.slow)
        for name in sorted(set(SMOOTH_METHODS) - {"dopri5"})
    ],
)
def test_the_fmu_agrees_with_other_solvers(solver: str, exported, monkeypatch) -> None:
    """All with the same direct integration."""
    references = import_module("lag2fmu.verify.references")
    once = lambda m, grid, *, rtol, **_: integrated_once(m, tuple(grid), rtol)  # noqa: E731
    monkeypatch.setattr(references, "integrate", once)
    report = lag2fmu.validate(exported("double_pendulum", solver=solver, optimised=True))
    assert report.passed, str(report)


@pytest.mark.parametrize(("model", "arguments"), [*((model, {}) for model in bundled()), *FAMILIES])
def test_a_mechanism_survives_the_way_through_text(model: str, arguments: dict[str, str]) -> None:
    """As it stands in its FMU, with what the derivation finds: the sources are the same.

    As it is written it reads back equal, from which the same follows: tests/formats/test_text.py has those without
    arguments.
    """
    mechanism = load(model, arguments)
    assert not arguments or read(write(mechanism), model) == mechanism
    description, sources = described(mechanism)
    again, same = described(read(write(description.mechanism), model))
    assert (again.variables, again.source_files) == (description.variables, description.source_files)
    assert same == sources


@pytest.mark.parametrize("model", bundled())
def test_every_variable_may_be_an_output(model: str) -> None:
    """Its functions are printed from their arguments alone."""
    _, sources = described(load(model), ["all"])
    assert "= ;" not in sources["mechanism.c"]


@pytest.mark.parametrize("model", ["four_bar_linkage", "six_axis_arm"])
def test_the_text_inside_an_fmu_gives_that_fmu_byte_for_byte(model: str, exported, tmp_path) -> None:
    first = exported(model, without=())
    again = export(read_mechanism(first.path), tmp_path / "again.fmu", solver=DEFAULT_SOLVER)
    assert filecmp.cmp(again.path, first.path, shallow=False)

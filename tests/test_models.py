"""Every bundled mechanism: its FMU against the direct integration, with the tolerance it declares and a sharp one."""

from __future__ import annotations

import filecmp

import pytest
from chosen import models

import lag2fmu
from lag2fmu.codegen import METHODS
from lag2fmu.fmu import export
from lag2fmu.mechanism.loading import bundled, load

pytestmark = pytest.mark.fmu

CHAOTIC = frozenset(("cart_pole", "double_pendulum", "n_pendulum", "furuta_pendulum"))
"""tests/fmu/test_accuracy.py has sharp bars for those whose motion is regular."""
FAMILIES = [
    ("n_pendulum", {"n": "1"}),
    ("n_pendulum", {"n": "5", "relative": "true"}),
    ("n_pendulum", {"n": "3", "frames": "true"}),
    ("coupled_masses", {"n": "9"}),
]


@pytest.mark.parametrize("model", bundled())
def test_the_fmu_agrees_with_the_direct_integration(model: str) -> None:
    report = lag2fmu.validate(model)
    assert report.passed, str(report)
    assert not any("Chaotic" in note for note in report.notes), "the bundled starts are compared until the end"


@pytest.mark.slow
@pytest.mark.parametrize("model", models(CHAOTIC))
def test_the_fmu_agrees_at_a_sharp_tolerance(model: str, exported) -> None:
    report = lag2fmu.validate(exported(model), tolerance=1e-10)
    assert report.passed, str(report)


@pytest.mark.parametrize(("model", "arguments"), FAMILIES)
def test_members_of_families_agree(model: str, arguments: dict[str, str], exported) -> None:
    report = lag2fmu.validate(exported(model, **arguments))
    assert report.passed, str(report)


@pytest.mark.parametrize("solver", sorted(set(METHODS) - {"dopri5"}))
def test_the_fmu_agrees_with_other_solvers(solver: str, exported) -> None:
    report = lag2fmu.validate(exported("double_pendulum", solver=solver))
    assert report.passed, str(report)


@pytest.mark.parametrize("model", models())
def test_a_mechanism_survives_the_way_through_text(model: str, tmp_path) -> None:
    """Exported from the text inside its own FMU, it is the same FMU byte for byte."""
    from lag2fmu.fmu import read_mechanism

    first = export(load(model), tmp_path / "first.fmu")
    again = export(read_mechanism(first.path), tmp_path / "again.fmu")
    assert filecmp.cmp(again.path, first.path, shallow=False)

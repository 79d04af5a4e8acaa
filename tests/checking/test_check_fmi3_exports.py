"""Nothing is found in what we export as FMI 3.0: flat and with arrays, with constraints and with contacts."""

from __future__ import annotations

import pytest

from lag2fmu.checking import check_fmu

pytestmark = pytest.mark.fmu

MODELS = ["cart_pole", "bouncing_ball", "hopper_leg", "four_bar_linkage", "slides_problem_5_massless", "woodpecker"]


@pytest.mark.parametrize("arrays", [False, True], ids=["flat", "arrays"])
@pytest.mark.parametrize("model", MODELS)
def test_nothing_is_found(model: str, arrays: bool, exported) -> None:
    found = check_fmu(exported(model, fmi="3.0", arrays=arrays).path)
    assert found.findings == (), str(found)
    assert any("trials" in note for note in found.notes)


def test_nothing_is_found_with_all_outputs(exported) -> None:
    found = check_fmu(exported("four_bar_linkage", fmi="3.0", arrays=True, outputs=("all",)).path)
    assert found.findings == (), str(found)

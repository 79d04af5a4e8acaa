"""The drawing of a live page: its C function fills the spots of the sketch, and its parts refer to them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from lag2fmu.dynamics.derivation import derive
from lag2fmu.dynamics.program import lower
from lag2fmu.fmu.live.drawing import drawing
from lag2fmu.fmu.live.spots import FUNCTION
from lag2fmu.formats.loading import load
from lag2fmu.mechanism import Mechanism

MODELS = ["double_pendulum", "four_bar_linkage", "heavy_top", "double_atwood", "crane", "spring_mass_damper"]
REFERENCES = ("at", "of", "ends", "frame", "ray", "turn", "extent", "hinge", "link", "vector", "tree")
"""The keys of a part that hold numbers of spots."""


def _mechanism(name: str) -> Mechanism:
    return derive(load(name)).mechanism


def _numbers(value: Any) -> Iterator[int]:
    if isinstance(value, list):
        for entry in value:
            yield from _numbers(entry)
    else:
        yield value


@pytest.mark.parametrize("name", MODELS)
def test_spots_are_where_the_sketch_has_them(name: str) -> None:
    mechanism = _mechanism(name)
    found = drawing(mechanism)
    assert found is not None
    s = found.spots.skeleton
    (function,) = found.spots.program(lower(derive(load(name)))).functions
    values = s.graph.evaluate([node for *_, node in function.results], s.start())
    count = found.data["count"]
    places = s.positions(s.start())[found.spots.numbers]
    assert function.name == FUNCTION
    assert np.allclose(np.reshape(values[: 3 * count], (count, 3)), places, atol=1e-12)
    assert len(values) == 3 * count + found.data["residuals"]
    assert np.abs(values[3 * count :]).max(initial=0.0) < 1e-9  # the start meets the constraints


@pytest.mark.parametrize("name", MODELS)
def test_parts_refer_to_spots_that_there_are(name: str) -> None:
    found = drawing(_mechanism(name))
    assert found is not None
    data = json.loads(json.dumps(found.data, allow_nan=False))
    used = {k for item in data["items"] for key in REFERENCES if key in item for k in _numbers(item[key])}
    used |= {spot for _, spot in data["handles"]}
    assert used <= set(range(data["count"]))
    assert {item["name"] for item in data["items"] if item["k"] in ("particle", "rod", "disc", "slider")} == {
        body.name for body in load(name).placed_bodies
    }


def test_a_wall_stays_and_the_spring_moves() -> None:
    """The spring ends at a wall that no coordinate moves, one spot of the block away."""
    found = drawing(_mechanism("spring_mass_damper"))
    assert found is not None
    (spring,) = (item for item in found.data["items"] if item["k"] == "spring")
    (block,) = (item for item in found.data["items"] if item["k"] == "slider")
    assert spring["ends"] == [block["at"]]
    assert np.hypot(*np.array(spring["wall"])[:2]) > 0


def test_nothing_is_drawn_of_a_lagrangian_alone() -> None:
    assert drawing(_mechanism("foucault_pendulum")) is None

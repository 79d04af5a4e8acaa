"""Which bundled models stand for all of them in tests that build an FMU for each; every kind is among them."""

from __future__ import annotations

from typing import Any

import pytest

from lag2fmu.formats.loading import bundled

REPRESENTATIVE = frozenset(
    (
        *("andrews_squeezer", "cart_pole", "chaplygin_sleigh", "double_pendulum", "elastic_pendulum"),
        *("four_bar_linkage", "free_body", "furuta_pendulum", "heavy_top", "humanoid_planar"),
        *("motion_driven_pendulum", "n_pendulum", "parallel_manipulator", "pendulum", "six_axis_arm"),
        *("slides_problem_1", "slides_problem_5_small", "spring_mass_damper", "vertically_driven_pendulum"),
    )
)

QUICK = REPRESENTATIVE - {"free_body", "furuta_pendulum", "heavy_top", "humanoid_planar", "six_axis_arm"}
"""Those that are integrated directly, to 1e-12, in seconds."""


def models(chosen: frozenset[str] = REPRESENTATIVE) -> list[Any]:
    """All bundled models as parameters; those that are not chosen only in 'make test-all'."""
    others = pytest.mark.all_models
    return [name if name in chosen else pytest.param(name, marks=others) for name in bundled()]

"""Which bundled models stand for all of them in tests that build an FMU for each; every kind is among them."""

from __future__ import annotations

from collections.abc import Container
from typing import Any

import pytest

from lag2fmu.dynamics import derive, lower
from lag2fmu.formats.loading import bundled, load

REPRESENTATIVE = frozenset(
    (
        *("andrews_squeezer", "cart_pole", "chaplygin_sleigh", "double_pendulum", "elastic_pendulum"),
        *("four_bar_linkage", "free_body", "furuta_pendulum", "heavy_top", "humanoid_planar"),
        *("motion_driven_pendulum", "n_pendulum", "parallel_manipulator", "pendulum", "six_axis_arm"),
        *("slides_problem_1", "slides_problem_5_small", "spring_mass_damper", "vertically_driven_pendulum"),
    )
)

KINDS = REPRESENTATIVE | frozenset(
    (
        *("backlash_slider_crank", "block_on_belt", "brake", "braked_wheel", "crane", "dc_motor", "disintegration"),
        *("gripper", "impact_oscillator", "rocking_block", "rolling_disc", "slides_problem_5_massless"),
        *("sliding_sphere", "sphere_on_turntable", "stack_of_blocks", "whipple_bicycle", "woodpecker"),
    )
)
"""Those beside which every other bundled model has a ``kind_of`` that is here: what is hybrid, too."""

QUICK = REPRESENTATIVE - {"free_body", "furuta_pendulum", "heavy_top", "humanoid_planar", "six_axis_arm"}
"""Those that are integrated directly, to 1e-12, in seconds."""

SENSITIVE = frozenset(
    (
        *("four_bar_linkage", "free_body", "heavy_top_quaternion", "kepler"),
        *("rutherford_scattering", "three_bodies", "two_bodies"),
    )
)
"""Smooth ones whose small errors grow more than 50 times, beyond the promise of accuracy, or, of the quaternion, whose
direct integration is not sharp enough. ``validate`` at a sharp tolerance knows what grows; all others have bars."""


def models(chosen: frozenset[str] = REPRESENTATIVE, among: Container[str] = KINDS) -> list[Any]:
    """The chosen models as parameters, and those ``among`` all bundled ones, these only in 'make test-all'."""
    others = pytest.mark.all_models
    taken = [name for name in bundled() if name in chosen or name in among]
    return [name if name in chosen else pytest.param(name, marks=others) for name in taken]


def kind_of(model: str) -> frozenset[str]:
    """What decides which code a model's FMU has and goes through, beside its size: the parts that it has any of."""
    equations = derive(load(model))
    mechanism, program = equations.mechanism, lower(equations)
    parts = ("contacts", "driven", "filtered", "inputs", "states", "stops", "tables")
    has = {part: bool(getattr(mechanism, part)) for part in parts}
    has |= {part: bool(getattr(program, part)) for part in ("frictions", "latches", "switches")}
    has |= {
        "holonomic constraints": bool(mechanism.holonomic),
        "nonholonomic constraints": len(mechanism.constraints) > len(mechanism.holonomic),
        "parameters that follow from others": bool(equations.dependent),
        "events": program.hybrid,
        "events in time": program.timed_bounds is not None,
    }
    return frozenset(name for name, is_there in has.items() if is_there)

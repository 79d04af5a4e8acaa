"""Names in files of robots: whatever their authors chose, the robot moves as with plain names."""

from __future__ import annotations

from itertools import count
from pathlib import Path
from random import Random

import numpy as np
import pytest
from kkt import solve

from lag2fmu import derive, load
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.mechanism.record import Mechanism

KINDS = ("revolute", "prismatic", "planar", "floating", "fixed")
_WORDS = (
    "g t a j k j_dot j_ddot a_mount mass_a mass_j damping_j damping_a friction_j stiffness_j stiffness_k "
    "rest_j length_k zero_j offset_j ratio_j armature_j gear_k gain_u_k u_k u_j Q_j p_j der_j der_j_dot "
    "j_x j_y j_angle j_e0 j_x_dot a_norm multiplier_a_norm friction_of_j friction_of_j_mode "
    "friction_of_j_force stop_of_j stop_of_j_lower stop_of_j_lower_gap damper_j_x spring_of_j "
    "place_of_u_k k_site_1 force_of_u_k joint_1 joint_2 tendon_0 actuator_0 fixed_a a_at_j world_ rate "
    "damping_j_turn kinetic_energy solver_step external_power time pi sin k_x k_c0 k_c1 equality_0 "
    "dissipated_energy j-dot j.dot"
)
TAKEN = _WORDS.split()
"""Names that an import makes, or that what it makes brings."""


def urdf(seed: int, names: list[str]) -> str:
    """A tree of eight links on joints of all kinds; the first half of the ``names`` is for links."""
    draw, half = Random(seed), len(names) // 2
    links, joints = names[:half], names[half:]
    text, leader = f'<link name="{links[0]}"/>', ""
    for k, (link, joint) in enumerate(zip(links[1:], joints, strict=False), 1):
        kind = draw.choice(KINDS) if k > 1 else "revolute"
        mimic = f'<mimic joint="{leader}" multiplier="0.7" offset="0.2"/>' if k > 2 and draw.random() < 0.3 else ""
        bounds = '<limit lower="-3" upper="3"/>' if kind in KINDS[:2] else ""
        dynamics = '<dynamics damping="0.3" friction="0.2"/>' if kind in KINDS[:2] else '<dynamics damping="0.4"/>'
        text += f"""<link name="{link}"><inertial><origin xyz="0.1 0 0.2"/><mass value="{k}"/>
          <inertia ixx="0.2" iyy="0.3" izz="0.4"/></inertial></link>
          <joint name="{joint}" type="{kind}"><parent link="{draw.choice(links[:k])}"/><child link="{link}"/>
          <origin xyz="0 0.1 0.3"/><axis xyz="0 1 0"/>{bounds}{dynamics}{mimic if kind in KINDS[:2] else ""}</joint>"""
        leader = leader or joint
    return f'<robot name="robot">{text}</robot>'


def mjcf(seed: int, names: list[str]) -> str:
    """Bodies on joints of all kinds, some of them without a name, with tendons, actuators and equalities."""
    draw, used = Random(seed), iter(names)

    def named() -> str:
        name = next(used)
        return f'name="{name}"' if draw.random() < 0.8 else ""

    tag = [next(used) for _ in range(5)]
    drive, cable = draw.sample(names, 2), draw.sample(names, 2)  # other kinds of objects have names of their own
    free = f'<body {named()} pos="0 0 3"><joint type="free" name="{tag[3]}" damping="0.2"/><geom size="0.3"/></body>'
    ball = f'<body {named()} pos="1 0 3"><joint type="ball" name="{tag[4]}" stiffness="3"/><geom size="0.2"/></body>'
    both = f'stiffness="{draw.randint(1, 9)}" damping="0.3" ref="0.1" armature="0.1"'
    return f"""<mujoco><option><flag contact="disable"/></option><worldbody><site name="nail" pos="0 0 1"/>
      <body {named()}><joint name="{tag[0]}" {both} axis="0 1 0" pos="0.1 0 0"/><geom size="0.1" pos="0.2 0 0"/>
        <site name="hook" pos="0.1 0.2 0"/>
        <body {named()} pos="0.3 0 0"><joint {named()} type="slide" axis="1 0 0" stiffness="2"/>
          <joint name="{tag[1]}" axis="0 0 1" pos="0 0.1 0" springref="0.2" stiffness="1"/><geom size="0.2"/></body>
      </body>
      <body {named()} pos="0 2 0"><joint name="{tag[2]}" axis="1 0 0" frictionloss="0.1"/>
        <geom size="0.1" pos="0 0 1"/></body>
      {free}{ball}</worldbody>
      <tendon><fixed name="{cable[0]}" stiffness="5" damping="0.2"><joint joint="{tag[0]}" coef="0.5"/></fixed>
        <spatial name="{cable[1]}" stiffness="7" damping="1"><site site="nail"/><site site="hook"/></spatial></tendon>
      <actuator><motor name="{drive[0]}" joint="{tag[0]}" gear="3"/>
        <position name="{drive[1]}" joint="{tag[1]}" kp="4"/>
        <motor site="nail"/><motor site="hook" gear="1 0 2 0 1 0"/></actuator>
      <equality><joint name="{draw.choice(names)}" joint1="{tag[1]}" joint2="{tag[2]}" polycoef="0 2 0 0 0"/></equality>
      </mujoco>"""


def accelerations(mechanism: Mechanism) -> np.ndarray:
    """The accelerations at a state and inputs that depend on nothing but their order."""
    at = {p.name: p.value for p in mechanism.parameters} | {"t": 0.0}
    at |= {u.name: 0.1 * k for k, u in enumerate(mechanism.inputs, 1)}
    for k, q in enumerate(mechanism.coordinates):
        at |= {q.name: 0.3 + 0.01 * k, f"{q.name}_dot": 0.2 - 0.03 * k, f"Q_{q.name}": 0.0}
    frictions = {f"{f.name}_force": 0.0 for f in mechanism.frictions}
    return solve(derive(mechanism), at | frictions)[0]


SEEDS = [0, 6, 8, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(20, 60))]


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("kind", ["urdf", "xml"])
def test_no_name_that_is_made_gets_in_the_way(kind: str, seed: int, tmp_path: Path) -> None:
    """Names drawn from those that imports make: every file is read, and its robot moves as with plain names."""
    if kind == "xml":
        pytest.importorskip("mujoco", reason="the optional package mujoco is not installed; 'make test-all' does so")
    chosen = Random(seed).sample(TAKEN, 16)
    plain = [f"plain{k}" for k, _ in zip(count(), chosen, strict=False)]
    found = []
    for names in (plain, chosen):
        path = tmp_path / f"robot.{kind}"
        path.write_text({"urdf": urdf, "xml": mjcf}[kind](seed, names))
        found.append(load(path, {"stops": seed % 2 == 0}))
    assert read(write(found[1]), "text") == found[1]
    ours, theirs = (accelerations(mechanism) for mechanism in found)
    assert theirs == pytest.approx(ours, rel=1e-9, abs=1e-9)


ALIKE = ["wrist", "wrist 1", "wrist-1", "wrist_1", "wrist.1", "wrist_1_2", "wrist/1", "handgelenk ä"]


@pytest.mark.parametrize("kind", ["urdf", "xml"])
def test_names_that_come_out_alike_are_numbered(kind: str, tmp_path: Path) -> None:
    if kind == "xml":
        pytest.importorskip("mujoco", reason="the optional package mujoco is not installed; 'make test-all' does so")
    found = []
    for names in ([*"abcdefgh"], ALIKE):
        path = tmp_path / f"robot.{kind}"
        path.write_text({"urdf": urdf, "xml": mjcf}[kind](1, [*names, *(f"{name}'" for name in names)]), "utf-8")
        found.append(load(path))
    assert accelerations(found[1]) == pytest.approx(accelerations(found[0]), rel=1e-9, abs=1e-9)

"""Robots in URDF: what becomes of links and joints, and what is wrong in a file is named."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from lag2fmu import derive, load
from lag2fmu.errors import Lag2FmuError
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.graph.batches import evaluate
from lag2fmu.mechanism.record import Mechanism

ROD = '<inertial><origin xyz="0 0 -0.5"/><mass value="2"/><inertia ixx="0.2" iyy="0.2" izz="0.001"/></inertial>'
PENDULUM = f"""
<robot name="pendulum">
  <link name="base"/>
  <link name="rod">{ROD}</link>
  <joint name="hinge" type="revolute">
    <parent link="base"/><child link="rod"/><origin xyz="0 0 1" rpy="0 0 1.57079632679"/><axis xyz="1 0 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/><dynamics damping="0.3"/>
  </joint>
</robot>"""


ARM = """
<robot name="arm">
  <link name="base"/>
  <link name="arm"><inertial><origin xyz="0.25 0 0"/><mass value="2"/>
    <inertia ixx="0.001" iyy="0.04" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint>
</robot>"""

Robot = Callable[..., Mechanism]


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    """What makes a mechanism of a text and options."""

    def made(text: str, **options: object) -> Mechanism:
        path = tmp_path / "robot.urdf"
        path.write_text(text)
        return load(path, options)

    return made


def accelerations(mechanism: Mechanism, **values: float) -> dict[str, float]:
    """The accelerations of a mechanism without constraints, at 0 where nothing else is said."""
    equations = derive(mechanism)
    at = {
        f"{kind}{q.name}{rate}": 0.0
        for q in mechanism.coordinates
        for kind, rate in (("", ""), ("", "_dot"), ("Q_", ""))
    }
    at |= {p.name: p.value for p in mechanism.parameters} | {"t": 0.0} | values
    assert equations.solution is not None
    found = evaluate(equations.graph, equations.solution.x, at)
    return dict(zip((q.name for q in mechanism.coordinates), found.tolist(), strict=True))


def test_a_pendulum_has_its_closed_form(robot: Robot) -> None:
    """phi'' = (-m g l sin phi - c phi') / (J + m l^2)."""
    found = accelerations(robot(PENDULUM), hinge=0.4, hinge_dot=0.7)
    exact = (-2 * 9.81 * 0.5 * np.sin(0.4) - 0.3 * 0.7) / (0.2 + 2 * 0.25)
    assert found["hinge"] == pytest.approx(exact, rel=1e-14)


def test_limits_are_bounds_and_with_stops_stops(robot: Robot) -> None:
    q = robot(PENDULUM).coordinates[0]
    assert (q.minimum, q.maximum, q.start) == (-2.0, 2.0, 0.0)
    stop = robot(PENDULUM, stops=True).stops[0]
    assert (stop.of, stop.lower, stop.upper) == (sp.Symbol("hinge", real=True), -2, 2)


def test_a_start_beyond_the_limits_is_the_nearest_one(robot: Robot) -> None:
    q = robot(PENDULUM.replace('lower="-2"', 'lower="0.5"')).coordinates[0]
    assert q.start == 0.5


@pytest.mark.parametrize("factor", [0.3, -2.0])
def test_what_a_mimic_joint_resists_acts_along_it(robot: Robot, factor: float) -> None:
    """A wheel that turns ``factor`` times the hinge: J phi'' = -m g l sin phi - (c + k^2 d) phi'; its stop is on it."""
    wheel = PENDULUM.replace(
        "</robot>",
        f"""<link name="wheel"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial></link>
        <joint name="axle" type="revolute"><parent link="base"/><child link="wheel"/><axis xyz="1 0 0"/>
        <limit lower="-0.5" upper="0.6"/><dynamics damping="0.7" friction="0.2"/>
        <mimic joint="hinge" multiplier="{factor}"/></joint></robot>""",
    )
    mechanism = robot(wheel)
    (friction,) = mechanism.frictions
    hinge_dot = sp.Symbol("hinge_dot", real=True)
    assert sp.simplify(friction.on / hinge_dot) == pytest.approx(factor)
    resisting = 0.3 + 0.7 * factor**2
    exact = (-2 * 9.81 * 0.5 * np.sin(0.4) - resisting * 0.8) / (0.2 + 2 * 0.25 + 0.1 * factor**2)
    assert accelerations(mechanism, hinge=0.4, hinge_dot=0.8, friction_of_axle_force=0.0)["hinge"] == pytest.approx(
        exact, rel=1e-12
    )
    assert mechanism.not_taken == ("limits of the joint axle, which mimics another one (stops take them)",)
    assert mechanism.warnings[0].endswith(mechanism.not_taken[0])
    stopped = robot(wheel, stops=True)
    stop = next(stop for stop in stopped.stops if stop.name == "stop_of_axle")
    assert tuple(map(float, (stop.of / sp.Symbol("hinge", real=True), stop.lower, stop.upper))) == (factor, -0.5, 0.6)
    assert stopped.not_taken == ()


def test_a_planar_joint_is_damped_along_and_about(robot: Robot) -> None:
    """A rod that moves in a plane: m x'' = -c x', J phi'' = -c phi', both with the joint's damping."""
    sliding = PENDULUM.replace("revolute", "planar").replace('origin xyz="0 0 -0.5"', 'origin xyz="0 0 0"')
    found = accelerations(robot(sliding), hinge_x_dot=0.5, hinge_y_dot=-0.2, hinge_angle_dot=0.9)
    assert found["hinge_x"] == pytest.approx(-0.3 * 0.5 / 2, rel=1e-12)
    assert found["hinge_angle"] == pytest.approx(-0.3 * 0.9 / 0.2, rel=1e-12)


NOT_TAKEN = {
    "<spring> of the joint hinge": ("<dynamics", '<spring k="3"/><dynamics'),
    "spring_stiffness in the <dynamics> of the joint hinge": ("<dynamics", '<dynamics spring_stiffness="3"'),
    "<fluid> of the link rod": ("<inertial>", "<fluid/><inertial>"),
    "<springStiffness> of hinge in <gazebo>": (
        "</robot>",
        '<gazebo reference="hinge"><springStiffness>5</springStiffness><kp>9</kp></gazebo></robot>',
    ),
    "<turnGravityOff> of rod in <gazebo>": (
        "</robot>",
        '<gazebo reference="rod"><turnGravityOff>true</turnGravityOff></gazebo></robot>',
    ),
    "<loop_joint>": ("</robot>", '<loop_joint name="x"/></robot>'),
    "friction of the joint hinge, which is planar": ('damping="0.3"', 'friction="0.3"'),
    "limits of the joint hinge, which is planar": ("<dynamics", "<dynamics"),
    "<mimic> of the joint hinge, which is planar": ("<dynamics", '<mimic joint="hinge"/><dynamics'),
}


@pytest.mark.parametrize("what", NOT_TAKEN)
def test_nothing_is_lost_without_a_word(robot: Robot, what: str) -> None:
    kind = "planar" if "planar" in what else "revolute"
    mechanism = robot(PENDULUM.replace(*NOT_TAKEN[what]).replace("revolute", kind))
    assert what in mechanism.not_taken
    assert any(what in warning for warning in mechanism.warnings)
    assert what in mechanism.provenance


def test_what_is_not_taken_of_many_joints_is_one_warning(robot: Robot) -> None:
    """The text lists each, in the order of the file and of the alphabet; the warnings tell their number."""
    link = PENDULUM[PENDULUM.index('<link name="rod"') : PENDULUM.index("</robot>")].replace("hinge", "{0}")
    odd = link.replace("<dynamics", '<dynamics wear="1" K="3"').replace('"rod"', '"rod_{0}"')
    chain = PENDULUM.replace("</robot>", "".join(odd.format(x) for x in "abcde") + "</robot>")
    found = robot(chain)
    assert found.not_taken == tuple(f"{x} in the <dynamics> of the joint {y}" for y in "abcde" for x in ("K", "wear"))
    assert found.warnings == tuple(
        f"not taken from the imported file: {x} in the <dynamics> of the joint a; the same of 4 more: b, c, d, ..."
        for x in ("K", "wear")
    )


LINK = '<link name="a"/>'
JOINT = '<joint name="j" type="revolute"><parent link="a"/><child link="b"/></joint>'


def pair(old: str = "", new: str = "", *, beside: str = "") -> str:
    """Two links on a joint, with ``old`` replaced by ``new``, and other elements ``beside`` them."""
    return f'<robot>{LINK}<link name="b">{ROD}</link>{JOINT}{beside}</robot>'.replace(old or "\0", new)


def fixed(name: str, child: str) -> str:
    """A link on a fixed joint."""
    return f'<link name="{child}"/><joint name="{name}" type="fixed"><parent link="a"/><child link="{child}"/></joint>'


LEGAL = {
    "a joint g": ("hinge", "g"),
    "a joint mass_rod": ("hinge", "mass_rod"),
    "a joint damping_hinge": ("hinge", "damping_hinge"),
    "a joint friction_of_rod_force": ("hinge", "friction_of_rod_force"),
    "a link rod_mount": ('"base"', '"rod_mount"'),
    "a joint t": ("hinge", "t"),
}


@pytest.mark.parametrize("what", LEGAL)
def test_authors_choose_their_names(robot: Robot, what: str) -> None:
    """The pendulum, sliding, moves as before, and the coordinate keeps the name of its joint where it can."""
    old, new = LEGAL[what]
    text = PENDULUM.replace("revolute", "prismatic").replace('xyz="1 0 0"', 'xyz="0 0 1"')
    found = robot(text.replace(old, new), stops=True)
    (q,) = found.coordinates
    assert q.name == {"hinge": "t_" if new == "t" else new}.get(old, "hinge")
    assert accelerations(found, **{f"{q.name}_dot": 0.7})[q.name] == pytest.approx(-9.81 - 0.3 * 0.7 / 2, rel=1e-12)


def test_a_joint_may_be_called_as_the_velocity_of_another_one(robot: Robot) -> None:
    second = JOINT.replace('"j"', '"j_dot"').replace('"a"', '"b"').replace('child link="b"', 'child link="c"')
    found = robot(pair(beside=f'<link name="c">{ROD}</link>{second}'))
    assert [q.name for q in found.coordinates] == ["j", "j_dot_2"]
    assert found.coordinates[1].doc == "joint j_dot"


def test_text_keeps_the_robot(robot: Robot) -> None:
    mechanism = robot(PENDULUM, base="floating", stops=True)
    assert read(write(mechanism), "text") == mechanism


def test_links_on_fixed_joints_are_lumped(robot: Robot) -> None:
    """Two halves of a rod on a fixed joint move as the rod does; Huygens, Steiner: J = 2 (m/2) (l/4)^2 + 2 J_half."""
    half = '<inertial><mass value="1"/><inertia ixx="0.0375" iyy="0.0375" izz="0.0005"/></inertial>'
    split = PENDULUM.replace(ROD, half.replace("<mass", '<origin xyz="0 0 -0.25"/><mass')).replace(
        "</robot>",
        f"""<link name="lower">{half}</link>
        <joint name="weld" type="fixed"><parent link="rod"/><child link="lower"/>
        <origin xyz="0 0 -0.75" rpy="0 3.14159265359 0"/></joint></robot>""",
    )
    whole = robot(split)
    assert [body.name for body in whole.bodies] == ["rod"]
    assert [point.name for point in whole.points] == ["lower"]
    inertia = 2 * 0.0375 + 2 * 0.25**2
    exact = (-2 * 9.81 * 0.5 * np.sin(0.4)) / (inertia + 2 * 0.25)
    assert accelerations(whole, hinge=0.4)["hinge"] == pytest.approx(exact, rel=1e-14)


def test_a_mimic_moves_with_its_leader(robot: Robot) -> None:
    """A slide that follows a hinge by 0.3 m/rad: the pair has one coordinate and the energy of both."""
    slide = PENDULUM.replace(
        "</robot>",
        """<link name="weight"><inertial><mass value="4"/></inertial></link>
        <joint name="slide" type="prismatic"><parent link="base"/><child link="weight"/>
        <axis xyz="0 0 1"/><mimic joint="hinge" multiplier="0.3" offset="0.1"/></joint></robot>""",
    )
    mechanism = robot(slide)
    assert [q.name for q in mechanism.coordinates] == ["hinge"]
    exact = (-2 * 9.81 * 0.5 * np.sin(0.4) - 4 * 9.81 * 0.3) / (0.2 + 2 * 0.25 + 4 * 0.3**2)
    assert accelerations(mechanism, hinge=0.4)["hinge"] == pytest.approx(exact, rel=1e-14)


@pytest.mark.parametrize(("base", "count"), [("fixed", 1), ("planar", 4), ("floating", 8)])
def test_bases(robot: Robot, base: str, count: int) -> None:
    text = PENDULUM.replace('<link name="base"/>', f'<link name="base">{ROD}</link>')
    assert len(robot(text, base=base).coordinates) == count


def test_friction_is_dry_friction(robot: Robot) -> None:
    mechanism = robot(PENDULUM.replace('damping="0.3"', 'friction="0.2"'))
    assert [(f.name, str(f.on), str(f.force)) for f in mechanism.frictions] == [
        ("friction_of_hinge", "hinge_dot", "friction_hinge")
    ]


BROKEN = {
    "no XML": ("<robot", "no well-formed XML"),
    "another root": ("<model/>", "is no robot"),
    "an entity": ('<!DOCTYPE robot [<!ENTITY x "y">]><robot/>', "document type"),
    "no links": ("<robot/>", "has no links"),
    "a link without a name": ("<robot><link/></robot>", "has no name"),
    "a joint without a name": (pair(' name="j"'), "has no name"),
    "two links of one name": (pair(beside=LINK), "two links are called 'a'"),
    "two joints of one name": (pair(beside=fixed("j", "c")), "two joints are called 'j'"),
    "two roots": (pair(beside='<link name="c"/>'), "2 links have no parent (a, c)"),
    "two parents": (pair(beside=JOINT.replace('"j"', '"k"')), "is the child of two joints, 'j' and 'k'"),
    "a circle": (pair(beside=JOINT.replace('"j"', '"k"').replace("parent", "x").replace("child", "parent")
                      .replace("x link", "child link")), "make a circle"),
    "an unknown link": (pair('child link="b"', 'child link="c"'), "there is no link 'c'"),
    "an unknown type": (pair("revolute", "revolut"), "did you mean 'revolute'"),
    "no parent": (pair('<parent link="a"/>'), "has no <parent link=...>"),
    "no mass": (pair('<mass value="2"/>'), "has no <mass>"),
    "no value": (pair('<mass value="2"/>', "<mass/>"), "the attribute 'value' is missing"),
    "a negative mass": (pair('value="2"', 'value="-2"'), "its mass is -2 kg"),
    "no number": (pair("0.001", "0,001"), "'0,001' is no number"),
    "not finite": (pair("0.001", "nan"), "is not finite"),
    "two numbers": (pair("0 0 -0.5", "0 -0.5"), "has 2 numbers"),
    "a zero axis": (pair("</joint>", '<axis xyz="0 0 0"/></joint>'), "its axis is 0 0 0"),
    "limits exchanged": (PENDULUM.replace('upper="2"', 'upper="-3"'), "exchange them"),
    "negative damping": (PENDULUM.replace("0.3", "-0.3"), "must not be negative"),
    "a mimic of nothing": (PENDULUM.replace("<dynamics", '<mimic joint="x"/><dynamics'), "mimics 'x'"),
    "a mimic of itself": (PENDULUM.replace("<dynamics", '<mimic joint="hinge"/><dynamics'), "in a circle"),
    "nothing moves": (PENDULUM.replace('"revolute"', '"fixed"'), "nothing moves"),
    "a tensor of no body": (PENDULUM.replace('ixx="0.2"', 'ixx="-0.2"'), "is not positive"),
    "two inertias": (pair(ROD, ROD + ROD), "<link> 'b': has 2 <inertial>, the second in line 1; leave one out"),
    "two limits": (PENDULUM.replace("<dynamics", '<limit lower="-1" upper="1"/><dynamics'), "has 2 <limit>"),
    "a macro": (pair(beside='<xacro:wheel side="left"/>'), "<xacro:wheel>: is a macro; write the robot out first"),
    "a value of a macro": (pair('value="2"', 'value="${m}"'), "<mass>: is a macro; write the robot out first: xacro"),
    "two masses": (pair('<mass value="2"/>', '<mass value="2"/><mass value="3"/>'), "has 2 <mass>"),
}  # fmt: skip


@pytest.mark.parametrize("what", BROKEN)
def test_what_is_wrong_is_named_in_one_sentence(robot: Robot, what: str) -> None:
    text, message = BROKEN[what]
    with pytest.raises(Lag2FmuError) as caught:
        robot(text)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_of_macros_gets_the_way_to_a_robot(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf.xacro").write_text(PENDULUM)
    with pytest.raises(Lag2FmuError, match="is a file of macros, which 'xacro' writes out as URDF; a model is"):
        load(tmp_path / "arm.urdf.xacro")


def test_an_unknown_base_is_named(robot: Robot) -> None:
    with pytest.raises(Lag2FmuError, match="base = 'free' is unknown; give one of fixed, floating, planar"):
        robot(PENDULUM, base="free")


def test_a_base_that_floats_needs_mass_and_the_message_stays_short(robot: Robot) -> None:
    """The formula of the force that has nothing to move would have a million operations."""
    with pytest.raises(Lag2FmuError, match=r"has no mass.* a formula of \d+ operations; ") as error:
        derive(robot(ARM, base="floating"))
    assert len(str(error.value)) < 500


def test_lumped_numbers_have_no_dust(robot: Robot) -> None:
    """A hand of 0.5 kg fixed to an arm of 2 kg, turned by 0.4: the sums are decimals of few digits."""
    text = (
        ARM.replace("</robot>", "")
        + """
  <link name="hand"><inertial><mass value="0.5"/>
    <inertia ixx="0.0002" iyy="0.0002" izz="0.0002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="wrist" type="fixed"><parent link="arm"/><child link="hand"/><origin xyz="0.5 0 0" rpy="0 0.4 0"/></joint>
</robot>"""
    )
    (body,) = robot(text).bodies
    assert [float(x) for x in body.center] == [0.3, 0.0, 0.0]
    assert [float(x) for x in body.inertia] == [0.0012, 0.0652, 0.0652, 0.0, 0.0, 0.0]

"""What is written and what follows from it: where each part comes from, and what stays as the user wrote it."""

from __future__ import annotations

from dataclasses import fields

import pytest

from lag2fmu.description.description import Description, table_keys
from lag2fmu.description.keys import keys_in
from lag2fmu.errors import MechanismError
from lag2fmu.formats.loading import with_values
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.language.expressions import symbol
from lag2fmu.mechanism import Body, Constraint, Frame, Joint, Load, Mechanism, Output, complete, coordinate, parameter
from lag2fmu.mechanism.name_check import check_names

NO_KEYS = {"moves", "name", "coordinate", "kind", "dimension", "declared", "nominal_from", "grid", "folder"}
"""Fields that are no keys: names of parts, the kind of a constraint (a table), what follows."""


def arm(**changes: object) -> Mechanism:
    """Two joints on parents, a free ball held at the arm's end, a quaternion, a load that is an input."""
    e = [coordinate(f"e{i}", "1", guess=float(i == 0)) for i in range(4)]
    tables = {
        "coordinates": [*(coordinate(k, "m") for k in "xyz"), *e],
        "frames": [Frame("free", origin=tuple(symbol(k) for k in "xyz"), quaternion=e), Frame("still")],
        "bodies": [
            Body("ball", 1, frame="free", inertia=(1, 1, 1, 0, 0, 0)),
            Body("rod", 1, frame="elbow", center=(1, 0, 0), inertia=(1, 1, 1, 0, 0, 0)),
        ],
        "joints": [
            Joint("shoulder", "revolute", parent="world", axis="z"),
            Joint("elbow", "revolute", parent="shoulder", origin=(1, 0, 0), axis="z"),
            Joint("grip", "spherical", ("rod", "ball"), reactions=True),
        ],
        "loads": [Load("push", "ball", input=True)],
    }
    return Mechanism("arm", **{**tables, **changes})


def names(parts: tuple[object, ...]) -> list[str]:
    return [part.name for part in parts]  # type: ignore[attr-defined]


def test_the_description_holds_what_is_written_and_nothing_else() -> None:
    d = arm().description
    assert names(d.coordinates) == ["x", "y", "z", "e0", "e1", "e2", "e3"]
    assert [q.given for q in d.coordinates] == [None] * 3 + [False] * 4
    assert (d.inputs, d.constraints, d.outputs) == ((), (), ())
    assert names(d.frames) == ["free", "still"]
    assert d.loads == (Load("push", "ball", input=True),)
    assert [joint.coordinates for joint in d.joints] == [(), (), ()]
    assert Description(**{item.name: getattr(d, item.name) for item in fields(d)}) == d


def test_every_part_that_follows_knows_what_brings_it() -> None:
    mechanism, d = arm(), arm().description
    followed = {
        f"{table}.{part.name}"
        for table in ("coordinates", "inputs", "frames", "constraints", "outputs")
        for part in getattr(mechanism, table)[len(getattr(d, table)) :]
    }
    assert mechanism.origins.keys() == followed
    assert mechanism.origins == {
        **{f"coordinates.{name}_angle": f"joints.{name}" for name in ("shoulder", "elbow")},
        **{f"frames.{name}": f"joints.{name}" for name in ("shoulder", "elbow")},
        **{f"inputs.push_{axis}": "loads.push" for axis in "xyz"},
        **{f"constraints.grip_{axis}": "joints.grip" for axis in "xyz"},
        **{f"outputs.grip_force_{axis}": "joints.grip" for axis in "xyz"},
        "constraints.free_norm": "frames.free.quaternion",
    }
    assert names(mechanism.constraints) == ["free_norm", "grip_x", "grip_y", "grip_z"]
    assert {q.given for q in mechanism.coordinates} == {False}


def test_the_text_is_the_description() -> None:
    mechanism = arm()
    text = write(mechanism)
    assert read(text, "arm") == mechanism
    assert write(read(text, "arm")) == text
    for key in ("input = true", "[frames.still]\n\n"):
        assert key in text
    for brought in ("_norm", "_angle", "push_x", "grip_", "[frames.elbow]", "start"):
        assert brought not in text


def test_a_text_that_writes_everything_out_says_the_same() -> None:
    """As texts in FMUs of earlier versions do."""
    mechanism = arm()
    outright = complete(mechanism)
    assert outright.origins == {}
    for table in table_keys():
        assert getattr(outright, table) == getattr(mechanism, table), table


@pytest.mark.parametrize(
    ("settings", "written"),
    [({"x": 0.3}, set()), ({"elbow_angle": 0.2}, {"coordinates"}), ({"push_y": 2.0}, {"inputs", "loads"})],
)
def test_values_of_what_is_brought_are_written_with_it(settings: dict[str, float], written: set[str]) -> None:
    before, after = arm(), with_values(arm(), settings)
    own = before.description
    assert {t for t in table_keys() if names_in(own, t) != names_in(after.description, t)} == written - {"loads"}
    assert [load.input for load in after.description.loads] == ["loads" not in written]
    assert read(write(after), "arm") == after
    for table in table_keys():
        assert names_in(before, table) == names_in(after, table)
    found = {part.name: part.start for part in (*after.coordinates, *after.inputs)}
    assert found == {part.name: part.start for part in (*before.coordinates, *before.inputs)} | settings
    assert [q.given for q in after.coordinates] == [q.given for q in before.coordinates]  # constraints: still guesses


def names_in(d: Description, table: str) -> list[str]:
    content = getattr(d, table)
    return [str(getattr(part, "name", part)) for part in content] if isinstance(content, tuple) else []


def test_coordinates_declared_with_a_joint_keep_the_order_of_all() -> None:
    turn = coordinate("turn", "deg", start=30.0)
    joints = [
        Joint("shoulder", "revolute", parent="world", axis="z"),
        Joint("elbow", "revolute", parent="shoulder", axis="z", coordinates=[turn]),
    ]
    rod = Body("rod", 1, frame="elbow", center=(1, 0, 0), inertia=(1, 1, 1, 0, 0, 0))
    mechanism = Mechanism("arm", coordinates=[], bodies=[rod], joints=joints)
    assert names(mechanism.coordinates) == ["shoulder_angle", "turn"]
    assert read(write(mechanism), "arm").coordinates == mechanism.coordinates


def test_other_starts_and_equilibria_extend_a_mechanism() -> None:
    mechanism = arm()
    moved = mechanism.starting_at(mechanism.coordinates[::-1])
    assert moved.coordinates == mechanism.coordinates[::-1]
    assert moved.description is mechanism.description
    assert moved == mechanism
    rest = Constraint("massless_x", symbol("x"), "equilibrium")
    longer = mechanism.with_equilibria([rest], mechanism.coordinates)
    assert longer.constraints == (*mechanism.constraints, rest)
    assert longer.origins["constraints.massless_x"] == "coordinates.x"
    check_names(longer)
    taken = arm(parameters=[parameter("residual_massless_x", 1.0)])
    with pytest.raises(MechanismError, match="'residual_massless_x' is already taken by the residual of constraint"):
        check_names(taken.with_equilibria([rest], taken.coordinates))


def test_a_fault_of_the_user_comes_before_a_clash_with_what_follows() -> None:
    """A norm that is written wrong is told to be wrong, and not to stand beside the right one."""
    with pytest.raises(MechanismError, match="free_norm: '0' contains no coordinate"):
        arm(constraints=[Constraint("free_norm", 0)])
    with pytest.raises(MechanismError, match=r"constraints\.holonomic\.free_norm has the name 'free_norm' already"):
        arm(constraints=[Constraint("free_norm", symbol("x"))])


def test_tables_take_their_parts_only() -> None:
    with pytest.raises(MechanismError, match="outputs: expected an output, got Frame"):
        arm(outputs=[Frame("a")])
    with pytest.raises(TypeError, match="there is no table 'bodys'; did you mean 'bodies'"):
        arm(bodys=[])
    with pytest.raises(TypeError, match=r"there is no table 'lagrangian'; give energy=Energy\(lagrangian=\.\.\.\)"):
        arm(lagrangian=0)


def test_every_field_of_a_part_is_a_key() -> None:
    """What is added to a part is read, written, checked and shown to editors, or it is named here."""
    for of in table_keys().values():
        without = {item.name for item in fields(of.part)} - {key.field for key in keys_in(of.part)}
        if of.part is Joint:
            without.remove("declared")
        assert without <= NO_KEYS, of.part
        for key in keys_in(of.part):
            assert key.doc or of.form == "expressions", (of.part, key.name)
            expression = key.kind in ("expression", "vector", "expression or vector", "axis")
            assert bool(key.names) == expression, (of.part, key.name)


def test_an_output_has_as_many_entries_as_its_point() -> None:
    x = coordinate("x", "m")
    shown = Output("at", point="b", quantity="position")
    flat = Mechanism("flat", coordinates=[x], bodies=[Body("b", 1, (x, 0))], outputs=[shown])
    assert list(flat.output_names) == ["at_x", "at_y"]
    assert flat.description.outputs[0] == shown

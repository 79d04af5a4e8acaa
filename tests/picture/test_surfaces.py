"""What is seen of visuals: solids as closed surfaces, meshes of files in place, and what is left out by name."""

from __future__ import annotations

import struct
import sys
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from lag2fmu.description.places import Body, Frame
from lag2fmu.description.symbols import coordinate, parameter
from lag2fmu.description.visuals import Visual
from lag2fmu.errors import MechanismError
from lag2fmu.fmu.live.drawing import drawing
from lag2fmu.formats.text import read, read_file
from lag2fmu.formats.write import write
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.picture.drawing import frame
from lag2fmu.picture.glyphs import hull
from lag2fmu.picture.layout import layout_of
from lag2fmu.picture.surfaces import Surface, surfaces


def volume(surface: Surface) -> float:
    """The volume (m3) that the triangles enclose, by the divergence theorem; negative if they are turned inside out."""
    a, b, c = (surface.vertices[surface.triangles[:, k]] for k in range(3))
    return float(np.sum(a * np.cross(b, c))) / 6.0


def still(*visuals: Visual) -> Mechanism:
    """A mechanism with these ``visuals`` in the world, and two parameters."""
    r, q = parameter("r", 0.5, "m"), coordinate("q", "m")
    return Mechanism(
        "still",
        coordinates=[q],
        parameters=[r, parameter("d", 2 * r, "m")],
        bodies=[Body("point", 1, position=(q, 0, 0))],
        visuals=visuals,
    )


def seen(**keys: object) -> Surface:
    (surface,), notes = surfaces(still(Visual("v", **keys)))  # type: ignore[arg-type]
    assert not notes
    return surface


@pytest.mark.parametrize(
    ("shape", "size", "expected"),
    [
        ("box", (1, 2, 3), 6.0),
        ("sphere", (2,), 4 / 3 * np.pi * 8),
        ("cylinder", (0.5, 3), np.pi * 0.75),
        ("capsule", (0.5, 3), np.pi * 0.75 + 4 / 3 * np.pi / 8),
        ("ellipsoid", (1, 2, 3), 4 / 3 * np.pi * 6),
    ],
)
def test_a_solid_is_closed_and_as_large_as_it_is(shape: str, size: tuple[float, ...], expected: float) -> None:
    """Circles have 32 corners, so that round solids are up to 3 % smaller; where they stand does not matter."""
    surface = seen(shape=shape, size=size, origin=(5, -7, 1), quaternion=(0.5, 0.5, 0.5, 0.5))
    at = Surface("", surface.vertices - [5, -7, 1], surface.triangles, "")
    for found in (volume(surface), volume(at)):
        assert 0.97 * expected < found < expected * (1 + 1e-9)


def test_a_solid_is_turned_and_moved() -> None:
    """A quarter turn about z takes the edge along x to y."""
    s = sp.sqrt(2) / 2
    surface = seen(shape="box", size=(2, 4, 6), origin=(10, 0, 0), quaternion=(s, 0, 0, s))
    assert np.ptp(surface.vertices, axis=0) == pytest.approx([4, 2, 6])
    assert surface.vertices.mean(axis=0) == pytest.approx([10, 0, 0])


def test_parameters_have_their_values() -> None:
    r, d = sp.Symbol("r", real=True), sp.Symbol("d", real=True)
    surface = seen(shape="box", size=(r, d, 4 * r), origin=(0, 0, d))
    assert np.ptp(surface.vertices, axis=0) == pytest.approx([0.5, 1, 2])
    assert surface.vertices.mean(axis=0) == pytest.approx([0, 0, 1])
    _, (note,) = surfaces(still(Visual("v", "sphere", size=(r - d,))))
    assert "the size of 'v' is not positive" in note


def pyramid(path: Path) -> None:
    """A binary STL file: the corner of a unit cube."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype="<f4")
    triangles = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    rows = (struct.pack("<12fH", 0, 0, 0, *corners[list(t)].ravel(), 0) for t in triangles)
    path.write_bytes(bytes(80) + struct.pack("<I", len(triangles)) + b"".join(rows))


def test_a_mesh_is_read_scaled_and_not_turned_inside_out(tmp_path: Path) -> None:
    pytest.importorskip("trimesh", reason="meshes are optional: pip install lag2fmu[meshes]")
    pyramid(tmp_path / "part.stl")
    for size, expected in (((1, 1, 1), 1 / 6), ((2, 3, -1), 1.0)):
        surface = seen(shape="mesh", file="part.stl", size=size, folder=tmp_path)
        assert volume(surface) == pytest.approx(expected)
        assert len(surface.vertices) == 4


def test_meshes_are_simplified_to_their_budget(tmp_path: Path) -> None:
    """Two balls of 20 480 triangles on a budget of 4000: each keeps its share, and its volume to a percent."""
    trimesh = pytest.importorskip("trimesh", reason="meshes are optional: pip install lag2fmu[meshes]")
    trimesh.creation.icosphere(subdivisions=5).export(tmp_path / "ball.stl")
    visuals = [Visual(name, "mesh", file="ball.stl", folder=tmp_path) for name in ("a", "b")]
    found, _ = surfaces(still(*visuals), 4000)
    assert [len(x.triangles) for x in found] == pytest.approx([2000, 2000], rel=0.01)
    assert volume(found[0]) == pytest.approx(4 / 3 * np.pi, rel=0.01)


def test_a_file_is_read_once_and_its_meshes_stand_where_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A shape stands twice in the scene of a file, once turned by a quarter, and two visuals show the file."""
    trimesh = pytest.importorskip("trimesh", reason="meshes are optional: pip install lag2fmu[meshes]")
    scene, shape = trimesh.Scene(), trimesh.creation.box(extents=(2, 4, 6))
    turned = trimesh.transformations.rotation_matrix(np.pi / 2, (0, 0, 1))
    for name, place in (("a", np.eye(4)), ("b", trimesh.transformations.translation_matrix((10, 0, 0)) @ turned)):
        scene.add_geometry(shape, node_name=name, geom_name="box", transform=place)
    scene.export(tmp_path / "parts.glb")
    read, load = [], trimesh.load_scene
    monkeypatch.setattr(trimesh, "load_scene", lambda path: read.append(path) or load(path))
    visuals = [Visual(name, "mesh", file="parts.glb", color=f"#{name * 6}", folder=tmp_path) for name in "ab"]
    found, notes = surfaces(still(*visuals))
    assert (len(read), notes, [x.color for x in found]) == (1, [], ["#aaaaaa"] * 2 + ["#bbbbbb"] * 2)
    for pair in (found[:2], found[2:]):
        first, second = sorted(pair, key=lambda x: float(x.vertices.mean()))
        assert np.ptp(first.vertices, axis=0) == pytest.approx([2, 4, 6])
        assert np.ptp(second.vertices, axis=0) == pytest.approx([4, 2, 6])
        assert second.vertices.mean(axis=0) == pytest.approx([10, 0, 0])


def test_more_vertices_than_a_page_can_count_are_left_out(tmp_path: Path) -> None:
    """30 000 triangles that share no corner have 90 000."""
    pytest.importorskip("trimesh", reason="meshes are optional: pip install lag2fmu[meshes]")
    corners = np.arange(30_000, dtype="<f4")[:, None] + np.array([0, 0, 0, 0.5, 0, 0, 0, 0.5, 0], dtype="<f4")
    rows = np.zeros(30_000, dtype=[("normal", "<f4", 3), ("corners", "<f4", 9), ("more", "<u2")])
    rows["corners"] = corners
    (tmp_path / "dust.stl").write_bytes(bytes(80) + struct.pack("<I", 30_000) + rows.tobytes())
    surface = seen(shape="mesh", file="dust.stl", folder=tmp_path)
    assert len(surface.vertices) <= 65_535
    assert surface.triangles.max() == len(surface.vertices) - 1
    assert np.array_equal(
        surface.vertices[surface.triangles[7]][1] - surface.vertices[surface.triangles[7]][0], [0.5, 0, 0]
    )


def test_what_is_not_drawn_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "bad.stl").write_bytes(b"solid nothing")
    visuals = [Visual(name, "mesh", file=f"{name}.stl", folder=tmp_path) for name in ("none", "bad")]
    found, (note,) = surfaces(still(*visuals, Visual("box", "box", size=(1, 1, 1))))
    assert len(found) == 1
    assert "not drawn: 2 of 3 visuals, as there is no file 'none.stl'; " in note
    monkeypatch.setitem(sys.modules, "trimesh", None)
    _, (note,) = surfaces(still(*visuals[1:]))
    assert "pip install 'lag2fmu[meshes]'" in note


def test_what_stands_in_a_package_is_found_beside_the_folders_above(tmp_path: Path) -> None:
    (tmp_path / "arm_description/meshes").mkdir(parents=True)
    (tmp_path / "arm_description/robots").mkdir()
    pyramid(tmp_path / "arm_description/meshes/part.stl")
    visual = Visual(
        "v", "mesh", file="package://arm_description/meshes/part.stl", folder=tmp_path / "arm_description/robots"
    )
    assert visual.find() == tmp_path / "arm_description/meshes/part.stl"


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"shape": "cone", "size": (1, 1)}, "visuals.v.shape: 'cone' is unknown; give one of box"),
        ({"shape": "mesh"}, "a 'file' goes with the shape 'mesh'"),
        ({"shape": "box", "size": (1, 1, 1), "file": "a.stl"}, "a 'file' goes with the shape 'mesh'"),
        ({"shape": "box"}, "visuals.v: 'size' is missing; give 3 lengths"),
        ({"shape": "sphere", "size": (1, 2)}, "visuals.v.size: has 2 entries; give 1"),
        (
            {"shape": "sphere", "size": (1,), "quaternion": (0, 0, 0, 0)},
            "visuals.v.quaternion: 0, 0, 0, 0 turns nothing",
        ),
        ({"shape": "sphere", "size": (1,), "color": "red"}, "'red' is no color; write it as #rrggbb"),
    ],
)
def test_what_is_wrong_is_said(keys: dict[str, object], said: str) -> None:
    with pytest.raises(MechanismError, match=r"visuals\.v") as error:
        Visual("v", **keys)  # type: ignore[arg-type]
    assert said in str(error.value)


def arm(**visual: object) -> Mechanism:
    """A body on a frame that turns about z, seen as a box beside its axis."""
    q = coordinate("q", "rad")
    keys = {"shape": "box", "frame": "arm", "size": (0.2, 0.1, 0.1), "origin": (0.5, 0, 0), "color": "#112233"} | visual
    return Mechanism(
        "turning",
        coordinates=[q],
        frames=[Frame("arm", rotations=[("x", sp.Float(0.3)), ("z", q)])],
        bodies=[Body("arm", 1, frame="arm", center=(sp.Rational(1, 2), 0, 0), inertia=(1, 1, 1, 0, 0, 0))],
        visuals=[Visual("cover", **keys)],  # type: ignore[arg-type]
    )


def test_visuals_stand_in_the_text(tmp_path: Path) -> None:
    mechanism = arm()
    text = write(mechanism)
    assert 'color = "#112233"' in text
    assert read(text, "turning") == mechanism
    path = tmp_path / "turning.toml"
    path.write_text(write(arm(shape="mesh", size=None, file="part.stl")), "utf-8")
    assert read_file(path).visuals[0].folder == tmp_path


def test_a_text_in_another_folder_names_the_same_mesh(tmp_path: Path) -> None:
    (tmp_path / "robots/meshes").mkdir(parents=True)
    (tmp_path / "texts").mkdir()
    pyramid(tmp_path / "robots/meshes/part.stl")
    mechanism = arm(shape="mesh", size=None, file="meshes/part.stl", folder=tmp_path / "robots")
    text = write(mechanism, tmp_path / "texts")
    assert 'file = "../robots/meshes/part.stl"' in text
    assert 'file = "meshes/part.stl"' in write(mechanism)
    found = read(text, str(tmp_path / "texts/arm.toml")).visuals[0].find()
    assert found is not None
    assert found.samefile(tmp_path / "robots/meshes/part.stl")


def test_a_frame_that_is_not_there_is_named() -> None:
    with pytest.raises(MechanismError, match=r"visuals.cover.frame: .*'leg'"):
        arm(frame="leg")


def test_a_page_draws_surfaces_where_their_frames_are() -> None:
    """Vertices come back from the bytes of the page; a body behind a surface is not drawn twice."""
    found = drawing(arm())
    assert found is not None
    (item,) = (x for x in found.data["items"] if x["k"] == "surface")
    assert not [x for x in found.data["items"] if x.get("name") == "arm" or x["k"] == "link"]
    counted = np.frombuffer(found.surfaces[: 6 * item["vertices"]], "<u2").reshape(-1, 3)
    vertices = np.array(item["low"]) + counted * np.array(item["step"])
    assert vertices.min(axis=0) == pytest.approx([0.4, -0.05, -0.05], abs=1e-5)
    assert vertices.max(axis=0) == pytest.approx([0.6, 0.05, 0.05], abs=1e-5)
    assert len(found.surfaces) == 6 * (item["vertices"] + item["triangles"])


def test_an_animation_shows_silhouettes() -> None:
    mechanism = arm()
    layout = layout_of(mechanism, surfaces(mechanism)[0])
    here, there = (
        next(np.array(x.points) for x in frame(layout, {"q": q}) if x.part == "visuals.arm") for q in (0.0, np.pi / 2)
    )
    assert np.array_equal(here[0], here[-1])
    assert len(here) - 1 <= 8
    right, up = (
        np.array([layout.view.flat(np.array(x)) for x in ([0.5, 0, 0], [0, 0.5 * np.cos(0.3), 0.5 * np.sin(0.3)])])
    ) / layout.unit
    assert here[:-1].mean(axis=0) == pytest.approx(right, abs=0.12 / layout.unit)
    assert there[:-1].mean(axis=0) == pytest.approx(up, abs=0.12 / layout.unit)


def test_the_hull_goes_around_to_the_left() -> None:
    points = np.array([[0.0, 0.0], [2, 0], [1, 0.5], [2, 2], [0, 2], [1, 1], [0, 0]])
    assert hull(points).tolist() == [[0, 0], [2, 0], [2, 2], [0, 2], [0, 0]]

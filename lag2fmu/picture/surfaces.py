"""What is seen of a mechanism as triangles: solids, and meshes of files, simplified until a page can carry them.

Meshes of other kinds than STL and DAE are read by trimesh, which takes half a second to be imported; all are
simplified by fast-simplification. Both are optional.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from lag2fmu.description.visuals import MESH, Visual
from lag2fmu.graph.batches import Floats
from lag2fmu.language.definitions import written_out
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.record import Mechanism

if TYPE_CHECKING:
    from lag2fmu.mesh_files import FileMesh

Triangles = NDArray[np.int64]

MOST_TRIANGLES = 40_000
"""The most triangles of all meshes of a mechanism together, some 300 kB of a page."""
_LEAST, _MOST_VERTICES = 100, 65_535
"""The triangles that a mesh keeps however many other meshes there are; and its most vertices, which 16 bits count."""
_MOST_BYTES = 256 << 20
_CLOSE = 1e-8
"""Corners that are so close, in the unit of a file, are one."""
_ROUND = 32
"""The corners of a circle."""
_NEEDED = "pip install 'lag2fmu[meshes]'"


@dataclass(frozen=True, eq=False)
class Surface:
    """What is seen of one visual: ``triangles`` (m, 3) of ``vertices`` (n, 3) in m, in the axes of its ``frame``.

    ``color`` is #rrggbb, or "" for that of bodies.
    """

    frame: str
    vertices: Floats
    triangles: Triangles
    color: str

    def _steps(self) -> tuple[Floats, Floats]:
        """The least vertex (3,), and the step (3,) by which 16 bits count from it."""
        low, high = self.vertices.min(axis=0), self.vertices.max(axis=0)
        return low, np.where(high > low, (high - low) / _MOST_VERTICES, 1.0)

    def head(self) -> dict[str, object]:
        """The numbers of ``vertices`` and ``triangles`` in ``content``, and how the former are counted."""
        low, step = self._steps()
        counts = {"vertices": len(self.vertices), "triangles": len(self.triangles)}
        return counts | {name: [float(f"{x:.6g}") for x in v] for name, v in (("low", low), ("step", step))}

    def content(self) -> bytes:
        """Vertices, counted from ``low`` in steps of ``step`` (m), and triangles, in 16 bits, the low byte first."""
        low, step = self._steps()
        return np.rint((self.vertices - low) / step).astype("<u2").tobytes() + self.triangles.astype("<u2").tobytes()

    @cached_property
    def outline(self) -> Floats:
        """The vertices (k, 3) that lie farthest in some of many directions: what a silhouette is made of."""
        k = np.arange(400) + 0.5
        rise, turn = np.arccos(1 - 2 * k / len(k)), np.pi * (1 + 5**0.5) * k
        towards = np.array([np.cos(turn) * np.sin(rise), np.sin(turn) * np.sin(rise), np.cos(rise)])
        found: Floats = self.vertices[np.unique(np.argmax(self.vertices @ towards, axis=0))]
        return found


def surfaces(mechanism: Mechanism, most: int = MOST_TRIANGLES) -> tuple[list[Surface], list[str]]:
    """The surfaces of the visuals, whose meshes have ``most`` triangles together, and a sentence on what is left out.

    Parameters have their values. A mesh that is not there, cannot be read, or is too large is left out.
    """
    visuals = _Numbers(mechanism).of_all(mechanism.visuals)
    meshes = cache(_meshes)  # several visuals may show one file
    read = [(visual, _read(visual, meshes) if visual.shape == MESH else _solid(visual)) for visual in visuals]
    missing = [made for _, made in read if isinstance(made, str)]
    found = [(x, v) for v, made in read if not isinstance(made, str) for x in made]
    count = sum(len(surface.triangles) for surface, visual in found if visual.shape == MESH)
    share = min(1.0, most / max(count, 1))
    stood = [_stood(_simplified(x, share) if v.shape == MESH else x, v) for x, v in found]
    return stood, [_left_out(missing, len(visuals))] if missing else []


class _Numbers:
    """Puts the values of parameters in the place of their names."""

    def __init__(self, mechanism: Mechanism) -> None:
        given = {p.name: p.expression for p in mechanism.parameters if p.expression is not None}
        self._meaning = written_out({**{d.name: d.expression for d in mechanism.definitions}, **given})
        self._values = {symbol(p.name): p.value for p in mechanism.parameters if p.value is not None}

    def of_all(self, visuals: Iterable[Visual]) -> list[Visual]:
        """``visuals`` in numbers alone."""
        return [self._of(visual) for visual in visuals]

    def _of(self, visual: Visual) -> Visual:
        place, turn = self._numbers(visual.origin), self._numbers(visual.quaternion)
        return replace(visual, size=visual.size and self._numbers(visual.size), origin=place, quaternion=turn)

    def _numbers(self, entries: Iterable[Any]) -> tuple[float, ...]:
        return tuple(self._number(sp.sympify(x)) for x in entries)

    def _number(self, entry: sp.Expr) -> float:
        return float(entry.xreplace(self._meaning).subs(self._values) if entry.free_symbols else entry)


def _left_out(missing: list[str], count: int) -> str:
    shown = "; ".join(dict.fromkeys(missing[:3]))
    more = ", ..." if len(missing) > 3 else ""
    return f"not drawn: {len(missing)} of {count} visuals, as {shown}{more}"


def _stood(surface: Surface, visual: Visual) -> Surface:
    """``surface`` scaled, turned and moved as ``visual`` says."""
    scale = np.array([float(x) for x in visual.size or (1, 1, 1)]) if visual.shape == MESH else np.ones(3)
    w, *v = (float(x) for x in visual.quaternion)
    e, vertices = np.array(v), surface.vertices * scale
    norm = w * w + e @ e or 1.0
    turned = vertices + 2 / norm * (w * np.cross(e, vertices) + np.cross(e, np.cross(e, vertices)))
    flipped = surface.triangles[:, ::-1] if np.prod(scale) < 0.0 else surface.triangles
    return replace(surface, vertices=turned + np.array([float(x) for x in visual.origin]), triangles=flipped)


# ---------------------------------------------------------------------------------------------------------- meshes


def _read(visual: Visual, meshes: Callable[[Path], list[Surface] | str]) -> list[Surface] | str:
    """The ``meshes`` in the file of ``visual``, one for each color, or why there are none."""
    path = visual.find()
    found = f"there is no file '{visual.file}'" if path is None else meshes(path)
    if isinstance(found, str):
        return found
    return [replace(mesh, frame=str(visual.frame), color=visual.color or mesh.color) for mesh in found]


def _meshes(path: Path) -> list[Surface] | str:
    """The meshes in the file at ``path``, in its own axes and colors, or why there are none."""
    if path.stat().st_size > _MOST_BYTES:
        return f"'{path.name}' has more than {_MOST_BYTES} bytes"
    try:
        import fast_simplification  # noqa: F401

        meshes = [_merged(mesh) for mesh in _in_file(path) if len(mesh.corners)]
    except ImportError:
        return f"meshes need the packages trimesh, pycollada and fast-simplification; {_NEEDED}"
    except Exception as error:  # what readers of strangers' files raise is theirs
        return f"'{path.name}' cannot be read: {error}"
    if not meshes or not all(np.isfinite(mesh.vertices).all() for mesh in meshes):
        return f"'{path.name}' has no triangles, or vertices that are not finite"
    return meshes


def _in_file(path: Path) -> Iterator[FileMesh]:
    from lag2fmu.mesh_files import collada_meshes, stl_count, stl_mesh

    kind = path.suffix.lower()
    if kind == ".dae":
        yield from collada_meshes(path)
    elif kind == ".stl" and stl_count(path):
        yield stl_mesh(path)
    else:
        yield from _of_others(path)


def _of_others(path: Path) -> Iterator[FileMesh]:
    """The meshes in the file at ``path``, read by trimesh."""
    import trimesh

    from lag2fmu.mesh_files import FileMesh

    scene: Any = trimesh.load_scene(str(path))
    for place, name in (scene.graph[node] for node in scene.graph.nodes_geometry):
        shape = scene.geometry[name]
        if len(getattr(shape, "faces", ())):
            rgba = getattr(getattr(shape.visual, "material", None), "main_color", None)
            color = "" if rgba is None else "#" + "".join(f"{int(x):02x}" for x in rgba[:3])
            corners = (shape.vertices @ place[:3, :3].T + place[:3, 3])[shape.faces].astype(np.float32)
            yield FileMesh(corners[:, ::-1] if np.linalg.det(place[:3, :3]) < 0.0 else corners, color)


def _merged(mesh: FileMesh) -> Surface:
    """The surface of ``mesh``, whose corners that are close are one vertex."""
    corners = mesh.corners.reshape(-1, 3).astype(np.float64)
    close = np.rint(corners / _CLOSE)
    order = np.lexsort(close.T)
    first = np.concatenate([[True], (np.diff(close[order], axis=0) != 0.0).any(axis=1)])
    places = np.empty(len(corners), dtype=np.int64)
    places[order] = np.cumsum(first) - 1
    return Surface("", corners[order[first]], places.reshape(-1, 3), mesh.color)


def _simplified(mesh: Surface, share: float) -> Surface:
    """``mesh`` with a ``share`` of its triangles, by quadric error metrics: Garland, Heckbert, SIGGRAPH 1997."""
    from fast_simplification import simplify

    vertices, triangles, count = mesh.vertices, mesh.triangles, len(mesh.triangles)
    most = max(_LEAST, int(share * count))
    if count > most:
        found = simplify(vertices.astype(np.float32), triangles.astype(np.int32), 1.0 - most / count)
        vertices, triangles = found[0].astype(np.float64), found[1].astype(np.int64)
    if len(vertices) > _MOST_VERTICES:  # triangles that share no corners
        used, places = np.unique(triangles[: _MOST_VERTICES // 3], return_inverse=True)
        vertices, triangles = vertices[used], places.reshape(-1, 3)
    return replace(mesh, vertices=vertices, triangles=triangles)


# ---------------------------------------------------------------------------------------------------------- solids


def _solid(visual: Visual) -> list[Surface] | str:
    """The surface of a solid, or why there is none."""
    size = [float(x) for x in visual.size or ()]
    if min(size) <= 0.0:
        return f"the size of '{visual.name}' is not positive"
    vertices, triangles = _box(size) if visual.shape == "box" else _revolved([*_profile(visual.shape, size)])
    if visual.shape == "ellipsoid":
        vertices = vertices * size
    return [Surface(str(visual.frame), vertices, triangles, visual.color)]


def _box(edges: Sequence[float]) -> tuple[Floats, Triangles]:
    vertices = np.array([*product((-0.5, 0.5), repeat=3)]) * edges
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return vertices, np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])


def _profile(shape: str, size: Sequence[float]) -> Iterator[tuple[float, float]]:
    """(radius, z) along the surface of a solid about z, from below to above."""
    half = 0.5 * size[1] if shape in ("cylinder", "capsule") else 0.0
    if shape == "cylinder":
        yield from ((0.0, -half), (size[0], -half), (size[0], half), (0.0, half))
        return
    radius = 1.0 if shape == "ellipsoid" else size[0]
    for angle in np.linspace(-np.pi / 2, np.pi / 2, _ROUND // 2 + 1):
        middle = [-half, half] if shape == "capsule" and abs(angle) < 1e-9 else [half if angle > 0 else -half]
        yield from ((round(radius * float(np.cos(angle)), 12), z + radius * float(np.sin(angle))) for z in middle)


def _revolved(profile: Sequence[tuple[float, float]]) -> tuple[Floats, Triangles]:
    """The surface that a ``profile`` sweeps about z; its triangles turn to the right about what points outwards."""
    turn = 2 * np.pi * np.arange(_ROUND) / _ROUND
    rings = [np.column_stack((r * np.cos(turn), r * np.sin(turn), np.full(_ROUND, z))) for r, z in profile]
    here = np.arange(_ROUND)
    beside = (here + 1) % _ROUND
    triangles = []
    for k in range(len(rings) - 1):
        low, high = k * _ROUND, (k + 1) * _ROUND
        triangles += [*zip(low + here, low + beside, high + beside, strict=True)] if profile[k][0] else []
        triangles += [*zip(low + here, high + beside, high + here, strict=True)] if profile[k + 1][0] else []
    return np.vstack(rings), np.array(triangles)


def packed(found: Iterable[Surface]) -> bytes:
    """Vertices and triangles of ``found``, one surface after the other, as the ``head`` of each says."""
    return b"".join(surface.content() for surface in found)

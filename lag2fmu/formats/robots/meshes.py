"""The corners of a mesh: what of it touches a plane first, from STL, OBJ and DAE files or from vertices.

DAE files need pycollada, which is optional.
"""

from __future__ import annotations

import re
from itertools import product
from pathlib import Path

import numpy as np

from lag2fmu.errors import LoadError
from lag2fmu.formats.robots.poses import Floats
from lag2fmu.mesh_files import collada_meshes, stl_count, stl_mesh

MOST_TRIANGLES = 1_000_000
_MOST_BYTES = 256 << 20
_DIRECTIONS = np.array([d for d in product((-1.0, 0.0, 1.0), repeat=3) if any(d)])
"""(26, 3): towards the faces, edges and corners of a cube. A box has a corner in each, however it is turned."""
_VERTEX = re.compile(rb"^\s*(?:vertex|v)\s+(\S+)\s+(\S+)\s+(\S+)", re.MULTILINE)


def corners(vertices: Floats) -> Floats:
    """The corners (n, 3) of the convex hull of ``vertices`` (m, 3) that lie farthest in 26 directions, at most 26."""
    far = np.unique(np.argmax(vertices @ _DIRECTIONS.T, axis=0))
    found: Floats = vertices[far]
    return found


def read_mesh(path: Path) -> Floats:
    """The vertices (m, 3) of the triangles in an STL or OBJ file, in its own unit, or in a DAE file, in m.

    Raises LoadError, with the remedy, for a file that cannot be read, is of another kind or too large.
    """
    kind = path.suffix.lower()
    if kind not in (".stl", ".obj", ".dae"):
        raise LoadError(
            f"{path}: meshes are read from .stl, .obj and .dae, not from '{kind}'; convert it, or leave its link out"
        )
    try:
        triangles = check_mesh(path)
        content = b"" if triangles else path.read_bytes()
    except OSError as error:
        raise LoadError(
            f"{path}: the mesh cannot be read: {error.strerror}; correct its name, or give a box"
        ) from error
    vertices = _collada(path) if kind == ".dae" else _stl(path) if triangles else _text(content, path)
    if not len(vertices) or not np.isfinite(vertices).all():
        raise LoadError(f"{path}: the mesh has no vertices, or one that is not finite; export it anew")
    return vertices


def check_mesh(path: Path) -> int:
    """How many triangles a binary STL file has, 0 of any other file.

    Raises LoadError for a mesh that is too large to be read, OSError for a file that is not there.
    """
    size = path.stat().st_size
    triangles = stl_count(path) if path.suffix.lower() == ".stl" else 0
    if triangles > MOST_TRIANGLES or size > _MOST_BYTES:
        has = f"{triangles} triangles" if triangles else f"{size} bytes"
        raise LoadError(
            f"{path}: the mesh has {has}; one of more than {MOST_TRIANGLES} triangles or {_MOST_BYTES} bytes is "
            "not read: give its convex hull, or a box"
        )
    return triangles


def _stl(path: Path) -> Floats:
    """The vertices (m, 3) of a binary STL file."""
    return stl_mesh(path).corners.reshape(-1, 3).astype(float)


def _collada(path: Path) -> Floats:
    """The vertices (m, 3) of all meshes of a DAE file where its scene puts them, in m."""
    try:
        parts = [mesh.corners.reshape(-1, 3).astype(float) for mesh in collada_meshes(path)]
    except ImportError as error:
        raise LoadError(f"{path}: reading .dae needs more packages; pip install 'lag2fmu[meshes]'") from error
    except Exception as error:  # what readers of strangers' files raise is theirs
        raise LoadError(f"{path}: the mesh cannot be read: {error}; export it anew") from error
    return np.vstack(parts) if parts else np.zeros((0, 3))


def _text(content: bytes, path: Path) -> Floats:
    """The vertices (m, 3) of an OBJ file or a STL file in words."""
    try:
        return np.array([[float(x) for x in found] for found in _VERTEX.findall(content)], dtype=float).reshape(-1, 3)
    except ValueError as error:
        raise LoadError(f"{path}: a vertex of the mesh is no number ({error}); export it anew") from error

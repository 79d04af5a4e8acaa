"""What is seen of a mechanism: solids and meshes on its frames, for pictures alone; nothing else depends on them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from os.path import relpath
from pathlib import Path

from lag2fmu.description.keys import CONSTANT, key
from lag2fmu.description.places import WORLD, Expression, Frame, normalise
from lag2fmu.errors import MechanismError
from lag2fmu.language.units import DIMENSIONLESS, METRE

MESH = "mesh"
SOLIDS = {"box": 3, "sphere": 1, "cylinder": 2, "capsule": 2, "ellipsoid": 3, MESH: 3}
"""{shape: the number of entries of its size}."""
_COLOR = re.compile(r"#[0-9a-f]{6}")
_PACKAGED = re.compile(r"(?:package|model)://([^/]+)/(.+)")


@dataclass(frozen=True)
class Visual:
    """What is seen on a ``frame``, for pictures alone: a solid of a ``size``, or the mesh in a ``file``.

    The size (m) of a box are its 3 edges, of a sphere its radius, of a cylinder or capsule radius and length along z
    (of a capsule between the centres of its ends), of an ellipsoid its 3 half axes; of a mesh 3 factors, by default 1.
    It stands at ``origin`` (m), turned by the unit ``quaternion``, its scalar part first, in the axes of its frame. All
    these are constant. The file is named as the text or the robot's file names it: relative to its ``folder``, or as
    package://NAME/FILE, NAME being a folder beside one of those above. A mesh that is not found is not drawn. Raises
    MechanismError for values of another form.
    """

    name: str
    shape: str = key(tuple(SOLIDS), "What it looks like.")
    frame: str | Frame = key("part", "The frame that carries it; by default the world.", default=WORLD)
    size: Sequence[Expression] | None = key(
        "vector",
        "In m: edges, radius, radius and length, half axes; of a mesh 3 factors.",
        default=None,
        names=CONSTANT,
    )
    file: str = key(
        "string", "Of a mesh: an STL, OBJ or DAE file; its name begins in the folder of this one.", default=""
    )
    origin: Sequence[Expression] = key(
        "vector", "3 entries in m, in the axes of the frame.", default=(0, 0, 0), names=CONSTANT, unit=METRE
    )
    quaternion: Sequence[Expression] = key(
        "vector", "4 entries, the scalar part first.", default=(1, 0, 0, 0), names=CONSTANT, unit=DIMENSIONLESS
    )
    color: str = key("string", "As #rrggbb; by default that of bodies.", default="")

    folder: Path = field(default=Path(), repr=False, compare=False)

    def __post_init__(self) -> None:
        where = f"visuals.{self.name}"
        normalise(self, where)
        if self.shape not in SOLIDS:
            raise MechanismError(f"{where}.shape: '{self.shape}' is unknown; give one of {', '.join(SOLIDS)}")
        if (self.shape == MESH) != bool(self.file):
            raise MechanismError(f"{where}: a 'file' goes with the shape '{MESH}', and no other has one; correct that")
        if self.size is None and self.shape != MESH:
            raise MechanismError(f"{where}: 'size' is missing; give {SOLIDS[self.shape]} lengths in m")
        counts = {"size": SOLIDS[self.shape], "origin": 3, "quaternion": 4}
        for label, count in counts.items():
            found = getattr(self, label)
            if found is not None and len(found) != count:
                raise MechanismError(f"{where}.{label}: has {len(found)} entries; give {count}")
        if all(x == 0 for x in self.quaternion):
            raise MechanismError(f"{where}.quaternion: 0, 0, 0, 0 turns nothing anywhere; leave it out, or correct it")
        if self.color and _COLOR.fullmatch(self.color) is None:
            raise MechanismError(f"{where}.color: '{self.color}' is no color; write it as #rrggbb")

    def find(self) -> Path | None:
        """The file of the mesh, None where there is none."""
        return find_file(self.file, self.folder)

    def named_from(self, folder: Path) -> Visual:
        """The same, its file named from another ``folder`` on, if it is there."""
        path = self.find()
        if path is None or self.folder.resolve() == folder.resolve():
            return self
        return replace(self, file=name_from(path, folder), folder=folder)


def name_from(path: Path, folder: Path) -> str:
    """The name of the file ``path`` from ``folder`` on, with slashes; all of it if that is on another drive."""
    try:
        return Path(relpath(path, folder.resolve())).as_posix()
    except ValueError:
        return path.as_posix()


def find_file(name: str, folder: Path) -> Path | None:
    """The file that a robot in ``folder`` calls ``name``, None where there is none.

    A file of a package://NAME/ is in a folder NAME beside the robot or beside one of the folders above it.
    """
    packaged, here = _PACKAGED.fullmatch(name), folder.resolve()
    if packaged is None:
        tried = [here / name.removeprefix("file://")]
    else:
        tried = [above / packaged[1] / packaged[2] for above in (here, *here.parents)]
    return next((path for path in tried if path.is_file()), None)

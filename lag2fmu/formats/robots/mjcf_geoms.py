"""What touches in a model that MuJoCo compiled: its own rules for which geoms do, with what friction and margin.

Source: https://mujoco.readthedocs.io/en/stable/computation/index.html#selection and #parameters.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from lag2fmu.formats.robots.compiled import Compiled, turned
from lag2fmu.formats.robots.ground import Ground
from lag2fmu.formats.robots.meshes import corners
from lag2fmu.formats.robots.poses import JointPose
from lag2fmu.formats.robots.tree import Geom, Touch

_KINDS = ("plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "points")  # mjtGeom
_SIZES = {"sphere": 1, "capsule": 2, "ellipsoid": 3, "cylinder": 2, "box": 3}
_ROUND = ("capsule", "sphere")
_TANGENTIAL = 3
"""The condim of a contact that only slides."""
_PROBE = """<mujoco><worldbody><geom type="plane" size="1 1 1" margin=".25" gap="{gap}"/>
<body><freejoint/><geom size=".1" margin=".5" gap="{gap}"/></body></worldbody></mujoco>"""


def touches(compiled: Compiled, ground: Ground, source: str) -> tuple[Touch, ...]:
    """All that touches by the ``ground``; what else would touch in MuJoCo is noted as ignored.

    Raises LoadError for a body of the ground that has no geom that touches.
    """
    return tuple(_GeomPairs(compiled, ground, source).found())


class _GeomPairs:
    def __init__(self, compiled: Compiled, ground: Ground, source: str) -> None:
        self._compiled, self._m, self._ground, self._source = compiled, compiled.model, ground, source
        self._names: dict[int, str] = {}
        self._left: Counter[str] = Counter()

    def found(self) -> Iterator[Touch]:
        m = self._m
        given = {(int(m.pair_geom1[k]), int(m.pair_geom2[k])): k for k in range(m.npair)}
        if self._compiled.disabled("CONTACT") or self._compiled.disabled("CONSTRAINT"):
            given = {}
        pairs = [*given, *(pair for pair in self._by_masks() if not {pair, pair[::-1]} & given.keys())]
        bodies = {int(m.geom_bodyid[g]) for pair in pairs for g in pair if m.body_weldid[m.geom_bodyid[g]]}
        self._ground.check_links((self._compiled.body(b) for b in bodies), self._source)
        for pair in pairs:
            yield from self._of(pair, given.get(pair))
        for text, count in self._left.items():
            self._compiled.ignored.append(text.format(count=f"{count} pair{'s' if count > 1 else ''}"))

    def _by_masks(self) -> Iterator[tuple[int, int]]:
        """The pairs of geoms that contype, conaffinity, excludes and the tree of bodies let touch."""
        m = self._m
        weld, excluded = m.body_weldid, {(s >> 16, s & 0xFFFF) for s in map(int, m.exclude_signature)}
        parent = weld[m.body_parentid[weld]]
        filtered = not self._compiled.disabled("FILTERPARENT")
        masks = zip(m.geom_contype.tolist(), m.geom_conaffinity.tolist(), m.geom_bodyid.tolist(), strict=True)
        touching = [(g, *rest) for g, rest in enumerate(masks) if rest[0] or rest[1]]
        for (g, type_g, with_g, b), (h, type_h, with_h, c) in combinations(touching, 2):
            if not (type_g & with_h or type_h & with_g) or weld[b] == weld[c] or {(b, c), (c, b)} & excluded:
                continue
            related = weld[b] and weld[c] and (parent[b] == weld[c] or parent[c] == weld[b])
            if not (filtered and related):
                yield g, h

    def _of(self, pair: tuple[int, int], given: int | None) -> Iterator[Touch]:
        """What becomes of a ``pair`` of geoms; ``given`` is the row of a <pair>, if it is one."""
        m, known = self._m, dict(enumerate(_KINDS))
        kinds = [known.get(int(m.geom_type[g]), "sdf") for g in pair]
        order = sorted((0, 1), key=lambda k: (kinds[k] == "plane", kinds[k] == "sphere", kinds[k]))
        (first, second), (kind, other) = (pair[k] for k in order), (kinds[k] for k in order)
        flat, both = other == "plane" and kind in (*_SIZES, "points"), kind in _ROUND and other in _ROUND
        if not self._taken(pair):
            self._left["contacts of {count} of geoms that are not of the ground's bodies"] += 1
        elif flat or (both and self._ground.pairs):
            yield self._touch(first, second, given)
        elif both:
            self._left["contacts of {count} of spheres and capsules (pairs takes them)"] += 1
        else:
            words = [word.replace("points", "mesh") for word in (kind, other)]
            self._left[f"contacts of {words[0]} with {words[1]}: {{count}}"] += 1

    def _taken(self, pair: tuple[int, int]) -> bool:
        """Whether the ground takes all bodies of the ``pair`` that move."""
        bodies = (int(self._m.geom_bodyid[g]) for g in pair)
        return all(self._ground.takes(self._compiled.body(b)) for b in bodies if self._m.body_weldid[b])

    def _touch(self, first: int, second: int, given: int | None) -> Touch:
        m, names = self._m, (self._name(first), self._name(second))
        if given is not None:
            dim, friction, margin = int(m.pair_dim[given]), m.pair_friction[given], float(m.pair_margin[given])
            margin -= self._counts_gap * float(m.pair_gap[given])
            if friction[0] != friction[1]:
                self._compiled.ignored.append(f"the second friction, {friction[1]:g}, of {names[0]} on {names[1]}")
        else:
            dim, friction, margin = self._mixed(first, second)
        if dim > _TANGENTIAL:
            self._left["turning and rolling friction of {count} of geoms"] += 1
        if dim > 1 and self._any("geom_surfacevel", first, second):
            self._left["velocities of the surfaces of {count} of geoms"] += 1
        if self._any("geom_adhesion", first, second) if given is None else self._any("pair_adhesion", given):
            self._left["adhesion of {count} of geoms"] += 1
        return Touch(self._geom(first), self._geom(second), 0.0 if dim == 1 else float(friction[0]), margin)

    def _mixed(self, first: int, second: int) -> tuple[int, Any, float]:
        """Condim, friction and margin of two geoms: of the one of higher priority, else the greater of each."""
        m, pair = self._m, [first, second]
        gap, both = self._counts_gap * m.geom_gap[pair], m.geom_margin[pair]
        margin = float(both.sum() if self._adds else both.max() - gap.max())
        ranks = m.geom_priority[pair]
        if ranks[0] != ranks[1]:
            leader = pair[int(np.argmax(ranks))]
            return int(m.geom_condim[leader]), m.geom_friction[leader], margin
        return int(m.geom_condim[pair].max()), m.geom_friction[pair].max(axis=0), margin

    def _any(self, name: str, *rows: int) -> bool:
        """Whether one of some ``rows`` of a list is not 0; a list that an older MuJoCo does not have is."""
        return hasattr(self._m, name) and bool(np.any(getattr(self._m, name)[list(rows)]))

    @cached_property
    def _counts_gap(self) -> bool:
        """Whether this MuJoCo takes the gap from the margin where a force begins."""
        return self._margin(0.0625) < self._margin(0.0)

    @cached_property
    def _adds(self) -> bool:
        """Whether this MuJoCo adds the margins of two geoms; it takes the greater one otherwise."""
        return self._margin(0.0) > 0.5

    def _margin(self, gap: float) -> float:
        mujoco = self._compiled.mujoco
        data = mujoco.MjData(model := mujoco.MjModel.from_xml_string(_PROBE.format(gap=gap)))
        mujoco.mj_forward(model, data)
        return float(data.contact[0].includemargin)

    def _name(self, geom: int) -> str:
        """The name of a geom, made up of its body and kind where it has none."""
        named = self._compiled.mujoco.mj_id2name(self._m, self._compiled.mujoco.mjtObj.mjOBJ_GEOM, geom)
        if not named and geom not in self._names:
            word = _KINDS[self._m.geom_type[geom]].replace("points", "mesh")
            wanted = f"{self._compiled.body(self._m.geom_bodyid[geom])}_{word}"
            count = sum(name.startswith(wanted) for name in self._names.values())
            self._names[geom] = f"{wanted}_{count + 1}" if count else wanted
        return str(named) if named else self._names[geom]

    def _geom(self, geom: int) -> Geom:
        m, kind = self._m, _KINDS[self._m.geom_type[geom]]
        vertices = None
        if kind == "points":
            mesh = m.geom_dataid[geom]
            at = m.mesh_vertadr[mesh]
            vertices = corners(m.mesh_vert[at : at + m.mesh_vertnum[mesh]].astype(float))
        pose = JointPose.of(m.geom_pos[geom].copy(), turned(m.geom_quat[geom]))
        size = tuple(map(float, m.geom_size[geom][: _SIZES.get(kind, 0)]))
        return Geom(self._name(geom), self._compiled.body(int(m.geom_bodyid[geom])), kind, pose, size, vertices)

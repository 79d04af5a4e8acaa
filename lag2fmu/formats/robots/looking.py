"""What is seen of a robot: the solids and meshes of its links as visuals on the frames that carry them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lag2fmu.description.visuals import Visual
from lag2fmu.formats.identifiers import identifier
from lag2fmu.formats.robots.parts import Parts
from lag2fmu.formats.robots.poses import Floats
from lag2fmu.formats.robots.tree import Look, Robot
from lag2fmu.formats.robots.writing import number, numbers


def look(robot: Robot, parts: Parts, folder: Path) -> list[Visual]:
    """The visuals of ``robot``, whose links are in ``parts`` already; its files are named from ``folder`` on."""
    return [_visual(seen, parts, folder) for seen in robot.looks]


def _visual(seen: Look, parts: Parts, folder: Path) -> Visual:
    frame, matrix, place = parts.carriers[seen.link]
    return Visual(
        parts.names.entry("visuals", identifier(seen.name)),
        seen.shape,
        frame,
        tuple(map(number, seen.size)) or None,
        seen.file,
        numbers(place.origin + matrix @ seen.pose.origin),
        numbers(_quaternion(matrix @ seen.pose.matrix)),
        seen.color,
        folder,
    )


def _quaternion(matrix: Floats) -> Floats:
    """The unit quaternion (4,) of a matrix (3, 3) of turns, its scalar part first and not negative.

    The greatest of the four, from which the others follow, is at least a half. Source: Shepperd, J. Guidance and
    Control 1 (1978) 223-224.
    """
    trace = np.trace(matrix)
    squares = np.array([trace, *(2 * np.diag(matrix) - trace)])
    k = int(np.argmax(squares))
    skew = np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])
    outer = np.zeros((4, 4))  # 4 e_i e_j for i != j
    outer[0, 1:] = outer[1:, 0] = skew
    outer[1:, 1:] = matrix + matrix.T
    row = outer[k]
    row[k] = 1.0 + squares[k]
    found: Floats = row / np.linalg.norm(row)
    return -found if found[0] < 0.0 else found

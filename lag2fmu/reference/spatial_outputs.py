"""The outputs that are quantities of places, frames and bodies in space, as numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lag2fmu.description.outputs import Output
from lag2fmu.description.places import WORLD
from lag2fmu.reference.frames import FramePose, Mass, Spot, apply_transposed, changing, turning
from lag2fmu.reference.functions import STEP, Array
from lag2fmu.reference.momenta import held, moving
from lag2fmu.reference.quaternions import Quaternions

Poses = dict[str, FramePose]


@dataclass(frozen=True)
class SpatialOutputs:
    """What outputs are told of: ``masses`` of bodies that are summed, ``spots`` on frames, the slots of ``gravity``."""

    masses: Mapping[str, Mass]
    spots: Mapping[str, Spot]
    gravity: slice
    quaternions: Quaternions

    def change(self, output: Output, poses: Poses, later: Poses, moved: Array) -> Array:
        """The quantity of accelerations that is ``output``, (3, N), from ``moved`` values a complex step later."""
        falling = moved[self.gravity].real
        if output.bodies is not None:
            return held(output, moving(self.masses, output, later, moved), falling, poses[str(output.frame)])
        if output.point is not None:
            change: Array = self.spots[str(output.point)].motion(later, moved)[1].imag / STEP
            return change
        frame = str(output.frame)
        change = changing(later[frame], str(output.quantity), falling)
        return change if output.axes == WORLD else apply_transposed(poses[frame].R, change)

    def quantity(self, output: Output, poses: Poses, values: Array, rows: Array) -> Array:
        """The entries of ``output``, (k, N), at the ``values`` of the slots; ``rows`` are those of ``Spatial``."""
        if output.bodies is not None:
            return moving(self.masses, output, poses, values).entries(output)
        if output.point is not None:
            return self.spots[str(output.point)].motion(poses, values)[output.quantity == "velocity"]
        if output.quantity == "quaternion":
            return self.quaternions(rows, str(output.frame))
        return turning(poses[str(output.frame)], str(output.quantity), in_world=output.axes == WORLD)

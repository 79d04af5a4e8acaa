"""The tables and keys of the text format: the one list that the reader (``text``) and the schema for editors share."""

from __future__ import annotations

from typing import NamedTuple

from lag2fmu.description.joints import JOINTS
from lag2fmu.description.outputs import QUANTITIES
from lag2fmu.description.places import WORLD


class Key(NamedTuple):
    """A key of a table.

    ``kind`` names what may stand there (``schema.VALUES`` has each kind); a tuple lists the only strings that may.
    """

    kind: str | tuple[str, ...]
    doc: str
    required: bool = False


TABLES = {
    "mechanism": "What the mechanism is.",
    "parameters": "Constants of the mechanism: NAME = { value = ..., unit = ... }.",
    "coordinates": "Generalized coordinates q; NAME_dot is the velocity of NAME.",
    "inputs": "Signals from outside that expressions may use.",
    "definitions": "Names for expressions that others use, in any order.",
    "energy": "Energies beside those of bodies and springs, which add theirs; or the whole Lagrangian.",
    "forces": "Generalized non-potential force on a coordinate: COORDINATE = expression.",
    "gravity": "Uniform gravity on all bodies.",
    "frames": "Frames that move in space.",
    "bodies": "Bodies: particles (no inertia), planar bodies (position and angle), spatial ones (frame).",
    "points": "Points that springs, dampers, loads and outputs refer to.",
    "springs": "Springs, by the elongation or between two points or bodies.",
    "dampers": "Dampers, by the rate or between two points or bodies.",
    "loads": "Forces at points and torques on bodies.",
    "joints": "Joints between frames, points and bodies, as constraints; or on a parent, as a frame that they carry.",
    "constraints": "Equations that hold all the time, each written as an expression that is zero.",
    "outputs": "Further outputs of the FMU.",
    "experiment": "What a default run looks like.",
}

_UNIT = Key("string", "A unit, e.g. m, kg.m2, N.m.s/rad, deg; 1: dimensionless; none: no check of dimensions.")
_DOC = Key("string", "A sentence for the reader.")
_BOUNDS = {"min": Key("number", "Smallest value, in the unit."), "max": Key("number", "Largest value, in the unit.")}
_AXES = Key((WORLD, "frame"), "Whose axes the entries are along; by default the world's.")
_BETWEEN = Key("names", "The two ends: names of points or bodies.")

SINGLE: dict[str, dict[str, Key]] = {
    "mechanism": {
        "name": Key("string", "An identifier; the name of the FMU.", required=True),
        "title": Key("string", "What it is, in a few words."),
        "source": Key("string", "Where equations and values come from."),
        "strict_units": Key("flag", "true: dimensions that do not match are an error, not a warning."),
    },
    "energy": {
        "kinetic": Key("expression", "Kinetic energy T in J."),
        "potential": Key("expression", "Potential energy V in J."),
        "dissipation": Key("expression", "Rayleigh's function R in W: the force is -dR/dqd."),
        "lagrangian": Key("expression", "The whole Lagrangian L in J, instead of T and V."),
    },
    "gravity": {
        "acceleration": Key("expression", "In m/s2.", required=True),
        "direction": Key("vector", "2 entries, 3 in space; by default along -y, in space along -z."),
    },
    "experiment": {
        "stop_time": Key("number", "In s."),
        "step": Key("number", "Communication step in s."),
        "tolerance": Key("number", "Relative tolerance of the solver."),
    },
}
"""Tables that stand once -> their keys."""

NAMED: dict[str, dict[str, Key]] = {
    "parameters": {
        "value": Key("number", "In the unit."),
        "expression": Key("expression", "In other parameters, instead of a value: it follows them."),
        "unit": _UNIT,
        "doc": _DOC,
        **_BOUNDS,
    },
    "coordinates": {
        "unit": _UNIT,
        "start": Key("number", "Given and exact, in the unit."),
        "velocity": Key("number", "Start of the velocity, given and exact, in the unit per s."),
        "guess": Key("number", "Instead of start: about here, solved for from the constraints."),
        "guess_velocity": Key("number", "Instead of velocity: about here, solved for from the constraints."),
        "nominal": Key("number", "Typical size, in the unit; the solvers' errors are measured by it."),
        **_BOUNDS,
        "doc": _DOC,
    },
    "inputs": {
        "unit": _UNIT,
        "start": Key("number", "Value while nothing is connected, in the unit."),
        "motion": Key("flag", "true: a prescribed motion NAME, NAME_dot, NAME_ddot, for positions and energies too."),
        **_BOUNDS,
        "doc": _DOC,
    },
    "frames": {
        "parent": Key("string", "The frame it moves in; by default the world."),
        "origin": Key("vector", "3 entries in m, in the parent's axes."),
        "rotations": Key("rotations", 'Turns about the moving axes, in turn, e.g. [["z", "q1"], ["y", "q2"]].'),
        "quaternion": Key("vector", "4 entries, the scalar part first, instead of rotations."),
    },
    "bodies": {
        "mass": Key("expression", "In kg.", required=True),
        "inertia": Key(
            "expression or vector", "In kg.m2 about the mass centre; in space [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]."
        ),
        "position": Key("vector", "The mass centre in m: 2 entries, 3 in space."),
        "angle": Key("expression", "The angle of a planar body in rad."),
        "frame": Key("string", "The frame a spatial body is fixed to, instead of a position."),
        "center": Key("vector", "The mass centre in the axes of the frame; by default its origin."),
    },
    "points": {
        "frame": Key("string", "The frame the point is fixed to; by default the world."),
        "position": Key("vector", "2 entries in m, 3 in space or in the axes of the frame.", required=True),
        "angle": Key("expression", "In the plane the angle of what it is fixed to, in rad, for joints."),
    },
    "springs": {
        "stiffness": Key("expression", "In N/m, of an angle in N.m/rad.", required=True),
        "elongation": Key("expression", "By how much it is longer than at rest; or give 'between'."),
        "between": _BETWEEN,
        "length": Key("expression", "The length at rest in m, with 'between'."),
    },
    "dampers": {
        "damping": Key("expression", "In N.s/m, of an angle in N.m.s/rad.", required=True),
        "rate": Key("expression", "The velocity it opposes; or give 'between'."),
        "between": _BETWEEN,
    },
    "loads": {
        "point": Key("string", "The point or body the force acts at."),
        "body": Key("string", "The body the force or the torque acts on."),
        "force": Key("vector", "Entries in N."),
        "torque": Key("expression or vector", "In N.m; 3 entries in space."),
        "input": Key("flag", "true: the load is an input of the FMU and has no value here."),
        "axes": _AXES,
    },
    "joints": {
        "kind": Key(tuple(JOINTS), "What joint it is.", required=True),
        "between": Key("names", "Two frames, points or bodies; of a gear two coordinates, or joints that have one."),
        "parent": Key("string", "Instead of between: the frame it stands on; it carries the frame of its own name."),
        "origin": Key("vector", "With parent: where the joint is, 3 entries in m, in the parent's axes."),
        "axis": Key("axis", "Fixed in the first one: x, y, z or 3 numbers; of a plane its normal."),
        "second_axis": Key("axis", "Fixed in the second one; by default the same numbers."),
        "coordinates": Key("names", "With parent: the names of its coordinates; by default NAME_angle and the like."),
        "pitch": Key("expression", "Of a screw, in m for a turn."),
        "radius": Key("expression", "Of a disc or sphere that rolls, in m."),
        "ratio": Key("expression", "Of a gear: the first coordinate is so many times the second."),
        "reactions": Key("flag", "true: the outputs NAME_force_x ... and NAME_torque_x ..., acting on the second."),
        "axes": Key((WORLD, "frame"), "Whose axes the reactions are along; frame: that of the first one."),
    },
    "outputs": {
        "expression": Key("expression", "In t, coordinates, velocities, accelerations, inputs, parameters."),
        "frame": Key("string", "The frame whose quantity it is."),
        "point": Key("string", "The point or body whose quantity it is."),
        "quantity": Key(tuple(QUANTITIES), "Of a point: position, velocity; the others are of a frame."),
        "axes": _AXES,
        "unit": _UNIT,
        "doc": _DOC,
    },
}
"""Tables with one sub-table for each name -> the keys of a sub-table."""

EXPRESSIONS = ("definitions", "forces")
"""Tables of one expression for each name."""

CONSTRAINT = {"expression": Key("expression", "What is zero.", required=True), "unit": _UNIT}
"""The keys of a constraint that is more than an expression."""

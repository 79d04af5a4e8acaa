"""What every element of a URDF file may hold: one child of a kind, numbers, vectors, a pose."""

from __future__ import annotations

import math

import numpy as np

from lag2fmu.errors import LoadError
from lag2fmu.formats.robots.poses import Floats, JointPose
from lag2fmu.xml_tree import XmlElement


class UrdfElements:
    """Reads elements of one file; ``where`` names it. What is wrong raises LoadError with the line of the element."""

    def __init__(self, where: str) -> None:
        self.where = where

    def error(self, element: XmlElement, text: str) -> LoadError:
        """An error that says ``text`` of ``element``."""
        label = f" {element.get('name')!r}" if element.get("name") else ""
        return LoadError(f"{self.where}, line {element.line}, <{element.tag}>{label}: {text}")

    def only(self, element: XmlElement, tag: str) -> XmlElement | None:
        """The child of ``element`` with the ``tag``, None without; raises LoadError where there are two."""
        found = list(element.all(tag))
        if len(found) > 1:
            raise self.error(element, f"has {len(found)} <{tag}>, the second in line {found[1].line}; leave one out")
        return found[0] if found else None

    def pose(self, element: XmlElement) -> JointPose:
        """The pose by <origin>: roll, pitch, yaw about fixed axes, which are turns about z, y, x of the moving axes."""
        origin = self.only(element, "origin")
        if origin is None:
            return JointPose(np.zeros(3))
        roll, pitch, yaw = self.vector(origin, "rpy", "0 0 0")
        turns = tuple((axis, float(angle)) for axis, angle in (("z", yaw), ("y", pitch), ("x", roll)) if angle)
        return JointPose(self.vector(origin, "xyz", "0 0 0"), turns)

    def vector(self, element: XmlElement, name: str, default: str) -> Floats:
        """The numbers (3,) of the attribute ``name``; raises LoadError for other counts and for what is no number."""
        words = element.get(name, default).split()
        if len(words) != 3:
            raise self.error(element, f"{name} = '{element.get(name)}' has {len(words)} numbers; expected 3")
        return np.array([self._finite(element, name, word) for word in words])

    def number(self, element: XmlElement, name: str, default: float | None = None) -> float:
        """The number of the attribute ``name``; raises LoadError where it is none, or missing without a ``default``."""
        if name not in element.attributes:
            if default is None:
                raise self.error(element, f"the attribute '{name}' is missing")
            return default
        return self._finite(element, name, element.get(name))

    def _finite(self, element: XmlElement, name: str, text: str) -> float:
        try:
            number = float(text)
        except ValueError:
            raise self.error(element, f"{name} = '{text}' is no number") from None
        if not math.isfinite(number):
            raise self.error(element, f"{name} = '{text}' is not finite")
        return number

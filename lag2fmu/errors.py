"""The exceptions of lag2fmu: one tree, so that ``except Lag2FmuError`` catches whatever a user can cause.

::

    Lag2FmuError
    +-- MechanismError          the description of a mechanism is wrong
    |   +-- ExpressionError     ... in the text of an expression
    |   +-- UnitError           ... in a unit or a dimension
    |   +-- TextError           ... at a place in a .toml file
    +-- LoadError               a model, file or value that was asked for is not there or not usable
    +-- DerivationError         the Lagrange equations cannot be derived
    +-- BuildError              no compiler, or the compiler failed
    +-- ExportError             the FMU cannot be written
    +-- SimulationError         the FMU cannot be simulated, or the direct integration failed

Every message names what is wrong, where, the value found and the remedy.
"""

from __future__ import annotations

from typing import Any


class Lag2FmuError(Exception):
    """Base of all errors a user can cause; the command line prints it and exits with 2."""


class MechanismError(Lag2FmuError):
    """The description of a mechanism is incomplete or contradicts itself."""


class ExpressionError(MechanismError):
    """The text of an expression cannot be read; the message carries the column."""


class UnitError(MechanismError):
    """An unknown unit, or quantities of different dimension that are added or assigned."""


class TextError(MechanismError):
    """A mechanism as text is wrong; the message starts with file, table and key."""


class LoadError(Lag2FmuError):
    """A model, file, or value that was asked for is missing or unusable."""


class DerivationError(Lag2FmuError):
    """The Lagrange equations of a well-formed mechanism cannot be derived or solved."""


class BuildError(Lag2FmuError):
    """The compiler is missing or failed; the message carries its output."""


class ExportError(Lag2FmuError):
    """The FMU cannot be written where it was asked for."""


class SimulationError(Lag2FmuError):
    """A simulation or a direct integration could not be done.

    ``reached`` is the trajectory until then, where the run of a system of FMUs ended early; else None.
    """

    reached: Any = None

"""Numbers of one FMU that are read, set and differentiated together, whatever their types, by FMI 2.0 and 3.0."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from ctypes import byref, c_double, c_size_t, c_uint, c_void_p
from functools import partial
from typing import Any

import numpy as np

from lag2fmu.errors import LoadError
from lag2fmu.verify.run import Floats, Scalar, size_of

_CALLS = {False: {"Enumeration": "Integer"}, True: {"Enumeration": "Int64"}}
"""{whether of FMI 3.0: {type of a variable: type of the call that reads it, where the two differ}}"""
_FLOATS = ("Real", "Float64", "Float32")
_DOUBLES = {False: "Real", True: "Float64"}
"""{whether of FMI 3.0: the type of variables that are doubles in C}"""
_WARNING = 1
"""The status of FMI 2.0 and 3.0 above which a call has not been done."""


class _Doubles:
    """Variables that are doubles, by arrays that are made once: a controller reads and sets them every millisecond."""

    def __init__(self, fmu: Any, references: Sequence[int], size: int, *, third: bool) -> None:
        """Prepare calls of ``fmu``, an instance of fmpy, for ``size`` numbers of the variables ``references``."""
        self.values: Floats = np.empty(size)
        named = (c_uint * len(references))(*references)
        numbers = (c_double * size).from_buffer(self.values)  # type: ignore[arg-type] # an array is a buffer
        arguments = [c_void_p.from_param(fmu.component), byref(named), c_size_t.from_param(len(references))]
        arguments += [byref(numbers), *([c_size_t.from_param(size)] if third else [])]  # these references keep arrays
        name = f"fmi{3 if third else 2}{{}}{_DOUBLES[third]}"
        self.read: Callable[[], Floats] = direct(fmu, name.format("Get"), arguments, self.values.copy)
        self.send = direct(fmu, name.format("Set"), arguments)

    def write(self, values: Floats) -> None:
        """Set them to ``values`` (size,)."""
        self.values[:] = values
        self.send()


def direct(fmu: Any, name: str, arguments: Sequence[Any], given: Callable[[], Any] | None = None) -> Callable[[], Any]:
    """A call of the function ``name`` of the library of ``fmu``, an instance of fmpy, with ``arguments`` of ctypes.

    These are converted once; who keeps them may change their values between calls. The call returns what ``given``
    returns then, and raises RuntimeError where the FMU refuses.
    """
    call, taken = fmu.dll[name], (*arguments,)

    def checked() -> Any:
        status = call(*taken)
        if status > _WARNING:
            raise RuntimeError(f"{name} returned status {status}")
        return None if given is None else given()

    return checked


def is_direct(fmu: Any) -> bool:
    """Whether ``fmu`` is an instance in this process; its calls may be prepared."""
    return isinstance(getattr(fmu, "component", None), int) and hasattr(fmu, "dll")


class _Part:
    """The scalars of one type: where their variables' elements lie among the values of a call."""

    def __init__(self, fmu: Any, kind: str, scalars: Sequence[Scalar], columns: Sequence[int], *, third: bool) -> None:
        self.kind, self.columns, self.sized = kind, list(columns), third
        self._get, self._set = (getattr(fmu, f"{verb}{kind}") for verb in ("get", "set"))
        offsets: dict[int, int] = {}
        self.size = 0
        for i in columns:
            if scalars[i].reference not in offsets:
                offsets[scalars[i].reference] = self.size
                self.size += size_of(scalars[i].variable)
        self.references = [*offsets]
        self.rows = [offsets[scalars[i].reference] + scalars[i].element for i in columns]
        self.plain = self.rows == list(range(self.size))
        fast = self.plain and kind == _DOUBLES[third] and is_direct(fmu)
        self.doubles = _Doubles(fmu, self.references, self.size, third=third) if fast else None

    def read(self) -> list[Any] | Floats:
        """The values of the scalars (columns,)."""
        if self.doubles is not None:
            return self.doubles.read()
        found = self._whole()
        return found if self.plain else [found[row] for row in self.rows]

    def _whole(self) -> list[Any]:
        """The values of the variables, all elements of arrays among them."""
        found: list[Any] = self._get(self.references, self.size) if self.sized else self._get(self.references)
        return found

    def write(self, values: Floats) -> None:
        """Set the scalars to ``values`` (columns,); other elements of arrays keep theirs."""
        if self.doubles is not None:
            self.doubles.write(values)
            return
        if self.plain and self.kind in _FLOATS:
            self._set(self.references, values.tolist())
            return
        whole = [0.0] * self.size if len(self.rows) == self.size else self._whole()
        for row, value in zip(self.rows, values, strict=True):
            whole[row] = self._typed(float(value))
        self._set(self.references, whole)

    def _typed(self, value: float) -> Any:
        if self.kind in _FLOATS:
            return value
        return value != 0 if self.kind == "Boolean" else round(value)


class Channel:
    """The ``scalars`` (k,) of an FMU, in their order."""

    def __init__(self, fmu: Any, scalars: Sequence[Scalar], *, third: bool) -> None:
        """Look up how they are read and set by the calls of ``fmu``; ``third``: by FMI 3.0."""
        self.scalars = scalars
        kinds = [_CALLS[third].get(s.variable.type, s.variable.type) for s in scalars]
        self._parts = [
            _Part(fmu, kind, scalars, [i for i, k in enumerate(kinds) if k == kind], third=third)
            for kind in sorted(set(kinds))
        ]

    def __len__(self) -> int:
        """How many numbers there are."""
        return len(self.scalars)

    def read(self) -> Floats:
        """The present values (k,)."""
        if len(self._parts) == 1:
            return np.asarray(self._parts[0].read(), dtype=float)
        values = np.empty(len(self.scalars))
        for part in self._parts:
            values[part.columns] = part.read()
        return values

    def write(self, values: Floats) -> None:
        """Set the numbers to ``values`` (k,); those that are no floating point numbers are rounded."""
        if len(self._parts) == 1:
            self._parts[0].write(values)
            return
        for part in self._parts:
            part.write(values[part.columns])

    @property
    def doubles(self) -> _Doubles | None:
        """What reads and sets them by the shortest way, if there is one."""
        return self._parts[0].doubles if len(self._parts) == 1 else None

    @property
    def references(self) -> list[int]:
        """The value references (k,)."""
        return [s.reference for s in self.scalars]

    @property
    def are_floats(self) -> bool:
        """Whether all are scalar variables that are floating point numbers, as derivatives need it."""
        return all(s.variable.type in _FLOATS and size_of(s.variable) == 1 for s in self.scalars)


# ------------------------------------------------------------------------------------------------- between steps

Commands = Mapping[Any, Any]
"""{input: number}, {array: its numbers} or {(input, ...): their numbers}, in SI units."""


def names_in(key: Any) -> tuple[Any, ...]:
    """The variables that a ``key`` of Commands names."""
    return key if isinstance(key, tuple) else (key,)


class Settables:
    """The keys of Commands, looked up once: a controller sets the same ones every millisecond."""

    def __init__(self, channel: Channel, sizes: Sequence[int]) -> None:
        """The ``channel`` sets the numbers of all keys, one after another, ``sizes`` of each."""
        self._write, self._sizes, self._whole = channel.write, sizes, len(sizes) == 1 and sizes[0] > 1
        doubles = channel.doubles
        values: Floats = np.empty(sum(sizes)) if doubles is None else doubles.values
        self._send = partial(channel.write, values) if doubles is None else doubles.send
        self._view: Any = memoryview(values)  # type: ignore[arg-type] # an array is a buffer

    def write(self, inputs: Commands) -> None:
        """Set what ``inputs`` gives these keys; raises LoadError for values that cannot be, or what the FMU raises."""
        given = [*inputs.values()]
        try:
            self._view[:] = given[0] if self._whole else np.asarray(given, dtype=float)
            usual = math.isfinite(sum(self._view))
        except (TypeError, ValueError):  # arrays among them, or other numbers than doubles
            usual = False
        if usual:
            self._send()
        else:
            parts = zip(inputs.items(), self._sizes, strict=True)
            self._write(np.concatenate([_part(*item, size) for item, size in parts]))


def _part(key: Any, value: Any, size: int) -> Floats:
    """The ``size`` numbers of one key."""
    name = ", ".join(map(str, names_in(key)))
    try:
        numbers = np.ravel(np.asarray(value, dtype=float))
    except (TypeError, ValueError):
        raise LoadError(f"the input {name} = {value!r} is no number") from None
    if len(numbers) != size:
        wanted = "one number" if size == 1 else f"{size} numbers"
        raise LoadError(f"the input '{name}' has {len(numbers)} numbers; give {wanted}")
    if not np.isfinite(numbers).all():
        raise LoadError(f"the input {name} = {value!r} is not finite; check what computes it")
    return numbers

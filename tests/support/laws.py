"""The laws of contacts and impacts of the C runtime, compiled alone and called with arrays."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse
from compiling import UNOPTIMISED, compiled
from numpy.typing import NDArray

from lag2fmu.resources import resource_folder

Array = NDArray[np.float64]
FREE, BILATERAL, UNILATERAL, TANGENTIAL, SLIDING, BOUNDED, GIVEN = range(7)
SEQUENTIAL, SIMULTANEOUS = range(2)
MOST_ROWS, MOST_CONTACTS = 24, 8
UNITS = (
    "arena",
    "arena_blocks",
    "central_path",
    "choices",
    "complementarity",
    "complementarity_large",
    "cones",
    "contact_rows",
    "elimination",
    "few_rows",
    "step_matrix",
    "impacts",
    "impacts_without_collision",
    "islands",
    "laws",
    "least_norm",
    "lone_rows",
    "lu",
    "newton",
    "newton_many",
    "newton_step",
    "scale",
    "shares",
    "sparse",
    "sparse_rows",
    "sweeps",
    "vector_length",
)
"""The files of the runtime that know nothing of a mechanism but its sizes."""
SIZES = f"#define SIZE_ROWS {MOST_ROWS}\n#define SIZE_ACTIVE {MOST_ROWS}\n#define SIZE_CONTACTS {MOST_CONTACTS}\n"
BATCH = """#include "complementarity.h"
void solve_all(int count, const Problem problems[], double lambda[], double w[], bool solved[]);
void solve_all(int count, const Problem problems[], double lambda[], double w[], bool solved[]) {
    for (int i = 0; i < count; i++) {
        solved[i] = complementarity_solve(&problems[i], lambda + i * problems[i].rows, w + i * problems[i].rows);
    }
}
"""
_ARENA = 2**20
"""The capacity (bytes) of the arena that the laws work in."""
_Doubles = ctypes.POINTER(ctypes.c_double)
_Integers = ctypes.POINTER(ctypes.c_int)


class Row(ctypes.Structure):
    """A row of a Delassus operator with its law."""

    _fields_ = [
        ("law", ctypes.c_int),
        ("normal", ctypes.c_int),
        ("friction", ctypes.c_double),
        ("holding", ctypes.c_double),
        ("value", ctypes.c_double),
        ("holds", ctypes.c_bool),
        ("slid", ctypes.c_bool),
    ]


class _Problem(ctypes.Structure):
    _fields_ = [
        ("arena", ctypes.c_void_p),
        ("rows", ctypes.c_int),
        ("delassus", _Doubles),
        ("free", _Doubles),
        ("row", ctypes.POINTER(Row)),
        ("determined", ctypes.POINTER(ctypes.c_bool)),
    ]


class _Sparse(ctypes.Structure):
    _fields_ = [("rows", ctypes.c_int), ("start", _Integers), ("column", _Integers), ("value", _Doubles)]


class _SparseProblem(ctypes.Structure):
    _fields_ = [
        ("arena", ctypes.c_void_p),
        ("delassus", _Sparse),
        ("free", _Doubles),
        ("row", ctypes.POINTER(Row)),
        ("yielding", ctypes.POINTER(ctypes.c_bool)),
        ("few", ctypes.c_void_p),
    ]


class Contact(ctypes.Structure):
    """A contact that touches: row of its normal, first row and number of its slips, ..., speed that counts as rest."""

    _fields_ = [
        ("normal", ctypes.c_int),
        ("slip", ctypes.c_int),
        ("slips", ctypes.c_int),
        ("restitution", ctypes.c_double),
        ("friction", ctypes.c_double),
        ("loaded", ctypes.c_bool),
        ("slow", ctypes.c_double),
    ]


class _ImpactProblem(ctypes.Structure):
    _fields_ = [
        ("arena", ctypes.c_void_p),
        ("rows", ctypes.c_int),
        ("delassus", _Doubles),
        ("velocities", _Doubles),
        ("bilateral", ctypes.POINTER(ctypes.c_bool)),
        ("contacts", ctypes.c_int),
        ("contact", ctypes.POINTER(Contact)),
        ("one_round", ctypes.c_bool),
    ]


class _ImpactResult(ctypes.Structure):
    _fields_ = [
        ("impulses", ctypes.c_double * MOST_ROWS),
        ("velocities", ctypes.c_double * MOST_ROWS),
        ("counts", ctypes.c_int * MOST_CONTACTS),
        ("rounds", ctypes.c_int),
        ("lost", ctypes.c_double),
        ("poisson", ctypes.c_bool),
        ("reduced", ctypes.c_bool),
        ("closed", ctypes.c_bool),
    ]


def normal(value: float = 0.0, holds: bool = False) -> Row:
    """A unilateral row."""
    return Row(UNILATERAL, 0, 0.0, 0.0, value, holds)


def tangential(of: int, friction: float, holding: float | None = None, holds: bool = False) -> Row:
    """A row of Coulomb friction at rest, bound by the normal force of row ``of``."""
    return Row(TANGENTIAL, of, friction, friction if holding is None else holding, 0.0, holds)


def sliding(of: int, friction: float, direction: float) -> Row:
    """A row of sliding friction."""
    return Row(SLIDING, of, friction, friction, direction, False)


def bounded(force: float, holding: float | None = None) -> Row:
    """A row of dry friction at rest."""
    return Row(BOUNDED, 0, force, force if holding is None else holding, 0.0, False)


def bilateral() -> Row:
    """A row of a permanent constraint."""
    return Row(BILATERAL, 0, 0.0, 0.0, 0.0, False)


@dataclass(frozen=True)
class Impact:
    """What follows from an impact; ``gained`` is the kinetic energy after minus before, from masses and velocities."""

    velocities: Array
    impulses: Array
    rows: Array
    counts: tuple[int, ...]
    rounds: int
    lost: float
    gained: float
    poisson: bool
    reduced: bool
    closed: bool


class Laws:
    """The compiled units."""

    def __init__(self, folder: Path) -> None:
        runtime = resource_folder("templates") / "engine"
        folders = (runtime / "base", runtime / "base" / "heap", runtime / "laws", runtime / "laws" / "moreau")
        paths = [folder / f"{name}.{ending}" for folder in folders for name in UNITS for ending in "ch"]
        sources = {path.name: path.read_text("utf-8") for path in paths if path.is_file()}
        sources |= {"mechanism.h": SIZES, "batch.c": BATCH}
        # tests/codegen/test_sources.py has them optimised
        self._library = compiled(folder, sources, options=UNOPTIMISED["zig"])
        for name in ("impacts_solve", "impacts_without_collision", "complementarity_large"):
            getattr(self._library, name).restype = ctypes.c_bool
        self._library.arena_begin.restype = ctypes.c_void_p
        self._memory = np.zeros(_ARENA // 8 + 64)  # numpy aligns it to 16 bytes
        self._arena = self.arena(self._memory)

    def arena(self, memory: Array) -> int:
        """The address of an arena in ``memory``."""
        return int(
            self._library.arena_begin(
                memory.ctypes.data_as(ctypes.c_void_p), ctypes.c_size_t(_ARENA), ctypes.c_size_t(0)
            )
        )

    def solve_all(self, delassus: Array, free: Array, rows: Sequence[Row]) -> tuple[NDArray[np.bool_], Array, Array]:
        """Whether solved[count], lambda[count, rows] and w[count, rows] of many problems with the same rows."""
        count, size = free.shape
        delassus, free = np.ascontiguousarray(delassus, float), np.ascontiguousarray(free, float)
        laws = (Row * size)(*rows)
        problems = (_Problem * count)(
            *(_Problem(self._arena, size, delassus[i].ctypes.data_as(_Doubles), free[i].ctypes.data_as(_Doubles), laws)
              for i in range(count))
        )  # fmt: skip
        forces, motions, solved = np.zeros((count, size)), np.zeros((count, size)), np.zeros(count, bool)
        pointers = (array.ctypes.data_as(ctypes.c_void_p) for array in (forces, motions, solved))
        self._library.solve_all(count, problems, *pointers)
        return solved, forces, motions

    def solve(self, delassus: Array, free: Array, rows: Sequence[Row]) -> tuple[bool, Array, Array]:
        """Whether solved, lambda[rows] and w[rows]."""
        solved, forces, motions = self.solve_all(np.asarray(delassus)[None], np.asarray(free, float)[None], rows)
        return bool(solved[0]), forces[0], motions[0]

    def solve_large(
        self,
        delassus: scipy.sparse.csr_matrix,
        free: Array,
        rows: Sequence[Row],
        guess: Array | None = None,
        rounds: int = 12,
        few: ctypes.Array[ctypes.c_char] | None = None,
    ) -> tuple[bool, Array, Array]:
        """Whether solved to rounding, and by rigid rows, lambda[rows] and w[rows] of a sparse problem.

        ``few`` is memory of zeros, or that of the last problem with the same operator.
        """
        size = len(free)
        start, column = delassus.indptr.astype(np.int32), delassus.indices.astype(np.int32)
        free, value = np.ascontiguousarray(free, float), np.ascontiguousarray(delassus.data, float)
        arrays = start.ctypes.data_as(_Integers), column.ctypes.data_as(_Integers), value.ctypes.data_as(_Doubles)
        matrix = _Sparse(size, *arrays)
        yielding = ctypes.c_bool(False)
        given = free.ctypes.data_as(_Doubles), (Row * size)(*rows), ctypes.pointer(yielding)
        problem = _SparseProblem(self._arena, matrix, *given, None if few is None else ctypes.addressof(few))
        forces, motions = np.zeros(size) if guess is None else guess.copy(), np.zeros(size)
        solved = self._library.complementarity_large(
            ctypes.byref(problem), rounds, forces.ctypes.data_as(_Doubles), motions.ctypes.data_as(_Doubles)
        )
        return bool(solved) and not yielding.value, forces, motions

    def impact(
        self,
        mass: Array,
        jacobian: Array,
        velocities: Array,
        contacts: Sequence[Contact],
        order: int | None = SEQUENTIAL,
        permanent: Sequence[int] = (),
        drive: Array | float = 0.0,
    ) -> Impact | None:
        """The impact of a mechanism with mass[n, n] and velocities[n]; without an order: without collision.

        ``drive``[rows] is the part of the rows' velocities that the velocities do not make.
        """
        mass, before = np.atleast_2d(mass), np.asarray(velocities, float)
        directions = np.linalg.solve(mass, np.atleast_2d(jacobian).T)
        delassus = np.ascontiguousarray(np.atleast_2d(jacobian) @ directions)
        rows = np.ascontiguousarray(np.atleast_2d(jacobian) @ before + drive)
        problem = _ImpactProblem(
            self._arena,
            len(rows),
            delassus.ctypes.data_as(_Doubles),
            rows.ctypes.data_as(_Doubles),
            (ctypes.c_bool * len(rows))(*(k in permanent for k in range(len(rows)))),
            len(contacts),
            (Contact * len(contacts))(*contacts),
            False,
        )
        result = _ImpactResult()
        if order is None:
            solved = self._library.impacts_without_collision(
                ctypes.byref(problem), ctypes.c_double(1e-6), ctypes.byref(result)
            )
        else:
            solved, made = True, -1
            while solved and made < result.rounds:  # nothing else comes under load where a contact comes to rest
                made = result.rounds
                solved = self._library.impacts_solve(ctypes.byref(problem), order, ctypes.byref(result))
                problem.velocities = ctypes.cast(result.velocities, _Doubles)
        if not solved:
            return None
        impulses = np.array(result.impulses[: len(rows)])
        after = before + directions @ impulses
        return Impact(
            after,
            impulses,
            np.array(result.velocities[: len(rows)]),
            tuple(result.counts[: len(contacts)]),
            result.rounds,
            result.lost,
            float(after @ mass @ after - before @ mass @ before) / 2,
            result.poisson,
            result.reduced,
            result.closed,
        )

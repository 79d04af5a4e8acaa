"""Results of a sweep as an xarray Dataset, in NetCDF and in Parquet. Everything is in SI units, which stand beside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from lag2fmu.errors import LoadError
from lag2fmu.language.units import Unit
from lag2fmu.studies.design import Design, SweepTask
from lag2fmu.studies.parts import PartStore
from lag2fmu.writing import replacing

ENDINGS = (".nc", ".parquet")
_NEEDS = {".nc": ("xarray", "h5netcdf", "h5py"), ".parquet": ("xarray", "pyarrow")}
_CHUNK = 65_536
"""The most numbers in one chunk of a NetCDF variable."""


def needed(package: str) -> Any:
    """The ``package``; raises LoadError with the line that installs it."""
    try:
        return import_module(package)
    except ImportError as error:
        raise LoadError(f"{package} is not installed; run 'pip install \"lag2fmu[sweeps]\"'") from error


def check_path(path: Path | None) -> None:
    """Raise LoadError, before any work, where the result cannot be written or a package is missing."""
    if path is not None and path.suffix not in ENDINGS:
        raise LoadError(f"'{path}': the result of a sweep ends in {' or '.join(ENDINGS)}")
    if path is not None and (path.is_dir() or not path.parent.is_dir()):
        raise LoadError(f"'{path}': is a folder, or its folder does not exist; choose another place")
    for package in ("xarray",) if path is None else _NEEDS[path.suffix]:
        needed(package)


def dataset(store: PartStore, task: SweepTask, design: Design, units: Mapping[str, Unit | None], title: str) -> Any:
    """The Dataset of a sweep: outputs over what varies, and over ``time`` (s) where there are several times.

    Each axis of a full grid is a dimension with the name of what varies along it; a sample has the dimension ``run``.
    ``failed`` says which runs failed, ``reason`` why. Values are in SI units. Raises LoadError where xarray is not
    installed, and for a damaged file.
    """
    xarray = needed("xarray")
    parts = list(store.parts())
    values = np.concatenate([part.values for part in parts])
    reasons = np.full(len(design), "", dtype=object)
    for i, part in enumerate(parts):
        for row, reason in part.reasons.items():
            reasons[store.rows(i).start + row] = reason
    dims, coordinates = _coordinates(design, units, task.outputs)
    shape = design.shape or (len(design),)
    timed = len(task.times) > 1
    if timed:
        coordinates["time"] = ("time", task.times, {"units": "s"})
    variables: dict[str, Any] = {}
    for j, name in enumerate(task.outputs):
        column = values[:, :, j].reshape(*shape, -1) if timed else values[:, 0, j].reshape(shape)
        variables[name] = ((*dims, "time") if timed else dims, column, _attributes(name, units))
    variables["failed"] = (dims, (reasons != "").reshape(shape))
    variables["reason"] = (dims, reasons.astype(str).reshape(shape))
    about = {"title": title, "stop_time": float(task.times[-1]), "values": "at the end" if not timed else "over time"}
    return xarray.Dataset(variables, coords=coordinates, attrs=about)


def _attributes(name: str, units: Mapping[str, Unit | None]) -> dict[str, str]:
    unit = units.get(name)
    return {} if unit is None else {"units": unit.si_name or "1"}


def _coordinates(
    design: Design, units: Mapping[str, Unit | None], outputs: Sequence[str]
) -> tuple[tuple[str, ...], dict[str, Any]]:
    """The dimensions of the runs, and what varies along them; the start of an output has its name with _start."""
    names = {name: f"{name}_start" if name in outputs else name for name in design.names}
    if not design.shape:
        columns = zip(design.names, design.values.T, strict=True)
        return ("run",), {names[name]: ("run", column, _attributes(name, units)) for name, column in columns}
    dims = tuple("_".join(names[name] for name in axis.names) for axis in design.axes)
    found: dict[str, Any] = {}
    for dim, axis in zip(dims, design.axes, strict=True):
        for name, column in zip(axis.names, np.asarray(axis.values).T, strict=True):
            found[names[name]] = (dim, column, _attributes(name, units))
    return dims, found


def save(found: Any, path: Path) -> None:
    """Write the Dataset to ``path``, whole or not at all; raises LoadError where that cannot be done."""
    try:
        with replacing(path) as new:
            (_save_netcdf if path.suffix == ".nc" else _save_parquet)(found, new)
    except OSError as error:
        raise LoadError(f"'{path}' cannot be written: {error.strerror or error}; choose another place") from error


def _save_netcdf(found: Any, path: Path) -> None:
    encoding = {
        name: {"chunksizes": _chunks(x.shape), "zlib": True} for name, x in found.items() if x.dtype.kind == "f"
    }
    found.to_netcdf(path, engine="h5netcdf", encoding=encoding)


def _chunks(shape: Sequence[int]) -> tuple[int, ...]:
    """The shape of a chunk: as many of the last dimensions as fit are whole."""
    chunks, room = [], _CHUNK
    for length in reversed(shape):
        chunks.append(max(1, min(length, room)))
        room //= chunks[-1]
    return tuple(reversed(chunks))


def _save_parquet(found: Any, path: Path) -> None:
    """One row a run, or a run and time; units in the metadata of the columns."""
    pyarrow, parquet = needed("pyarrow"), needed("pyarrow.parquet")
    flat = {name: x.broadcast_like(_widest(found)).values.ravel() for name, x in {**found.coords, **found}.items()}
    fields = []
    for name, column in flat.items():
        kind = {"f": pyarrow.float64(), "b": pyarrow.bool_()}.get(column.dtype.kind, pyarrow.string())
        unit = found[name].attrs.get("units")
        fields.append(pyarrow.field(name, kind, metadata={"units": unit} if unit else None))
    schema = pyarrow.schema(fields, metadata={str(k): str(v) for k, v in found.attrs.items()})
    parquet.write_table(pyarrow.table(list(flat.values()), schema=schema), path, row_group_size=_CHUNK)


def _widest(found: Any) -> Any:
    return max(found.values(), key=lambda x: x.ndim)

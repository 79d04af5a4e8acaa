"""What a calibration found: estimates with their uncertainty, fits, and the calibrated mechanism."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lag2fmu.errors import ExportError, LoadError
from lag2fmu.formats.write import write
from lag2fmu.language.identifiers import suggestion
from lag2fmu.mechanism.display import display_units
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.trajectory import Floats
from lag2fmu.studies.fits import Fit, FreeValue
from lag2fmu.writing import replacing

SINGULAR = 1e-6
"""Relative to the greatest singular value: the data do not determine a direction with a smaller one."""
_TAKES_PART = 0.3
"""Relative to its greatest entry: a message on a direction names the entries that are not smaller."""
_AT_BOUND = 1e-6
"""A value is at a bound if it is nearer than this part of its scale."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """Estimates and what is known of them, in SI units.

    - ``names``: those of the p parameters and starts. With several experiments a start has its number: theta[2].
    - ``estimates``, ``standard_errors``: (p,); ``correlations``: (p, p).
    - ``noise``: {column: standard deviation}, given or estimated.
    - ``degrees_of_freedom``: the number of measured values less the number of estimated ones.
    - ``chi_squared``: the sum of squares in units of the noise.
    - ``warnings``: sentences.
    - ``mechanism``: the mechanism with the estimates, and the starts of the first experiment.

    Source: G. A. F. Seber, C. J. Wild, Nonlinear Regression, 1989, section 2.1.
    """

    names: tuple[str, ...]
    estimates: Floats
    standard_errors: Floats
    correlations: Floats
    noise: dict[str, float]
    chi_squared: float
    degrees_of_freedom: int
    warnings: tuple[str, ...]
    fits: tuple[Fit, ...] = field(repr=False)
    mechanism: Mechanism = field(repr=False)
    free: tuple[FreeValue, ...] = field(repr=False)

    def __getitem__(self, name: str) -> float:
        """The estimate of ``name`` in SI units; raises LoadError if ``name`` was not estimated."""
        return float(self.estimates[self._place(name)])

    def __repr__(self) -> str:
        """One line: the mechanism and the estimates."""
        found = ", ".join(f"{name} = {x:.6g}" for name, x in zip(self.names, self.estimates, strict=True))
        return f"<Calibration of {self.mechanism.name}: {found}>"

    def __str__(self) -> str:
        """A line for each estimate, in SI units with its standard error and its interval of 95 %; then the warnings."""
        width = max(map(len, self.names))
        lines = [f"Calibration of {self.mechanism.name}, {self.degrees_of_freedom} degrees of freedom, SI units"]
        for name, estimate, error in zip(self.names, self.estimates, self.standard_errors, strict=True):
            low, high = self.confidence(name)
            lines.append(f"{name:{width}} = {estimate:.6g} +- {error:.2g}  ({low:.6g} to {high:.6g} with 95 %)")
        return "\n".join([*lines, *self.warnings])

    def _repr_html_(self) -> str:
        """Estimates with standard errors and intervals of 95 %, in SI units, for a notebook."""
        from html import escape

        head = "<tr><th></th><th>estimate</th><th>standard error</th><th>with 95 %</th></tr>"
        rows = ""
        for name, estimate, error in zip(self.names, self.estimates, self.standard_errors, strict=True):
            low, high = self.confidence(name)
            rows += f"<tr><th>{escape(name)}</th><td>{estimate:.6g}</td><td>{error:.2g}</td>"
            rows += f"<td>{low:.6g} to {high:.6g}</td></tr>"
        return f"<table>{head}{rows}</table>" + "".join(f"<p>{escape(text)}</p>" for text in self.warnings)

    def confidence(self, name: str, level: float = 0.95) -> tuple[float, float]:
        """The interval (SI) that holds ``name`` with the probability ``level``, by Student's distribution.

        Raises LoadError for another name, or a level that is no probability.
        """
        from scipy.stats import t

        if not 0 < level < 1:
            raise LoadError(f"the level {level!r} of a confidence interval is not between 0 and 1")
        i = self._place(name)
        width = float(t.ppf(0.5 + level / 2, max(1, self.degrees_of_freedom)) * self.standard_errors[i])
        return float(self.estimates[i]) - width, float(self.estimates[i]) + width

    def _place(self, name: str) -> int:
        if name not in self.names:
            raise LoadError(f"'{name}' was not estimated; {suggestion(name, self.names)}")
        return self.names.index(name)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the calibrated mechanism to ``path`` (.toml); raises ExportError if it cannot be written there."""
        target = Path(path)
        if target.suffix != ".toml":
            raise ExportError(f"'{target}': a mechanism is written as .toml")
        try:
            with replacing(target) as new:
                new.write_text(write(self.mechanism), "utf-8", newline="\n")
        except OSError as error:
            raise ExportError(f"cannot write '{target}': {error.strerror}; choose another place") from error

    def plot(self) -> Any:
        """A figure of matplotlib: measured and fitted columns of each experiment, and their residuals."""
        from lag2fmu.studies.calibration_figure import calibration_figure

        return calibration_figure(self.fits, self.noise, display_units(self.mechanism))


def summed_up(
    estimates: tuple[FreeValue, ...],
    jacobian: Floats,
    residuals: Floats,
    noise: dict[str, float],
    fits: tuple[Fit, ...],
    mechanism: Mechanism,
) -> Calibration:
    """The calibration that a search ended with.

    ``jacobian`` (n, p) and ``residuals`` (n,) are those at the estimates, in units of the noise. Source: G. A. F.
    Seber, C. J. Wild, Nonlinear Regression, 1989, section 2.1.
    """
    names = tuple(x.label for x in estimates)
    scale = np.array([x.scale for x in estimates])
    free = np.array([not _at_bound(x) for x in estimates])
    covariance, warnings = _covariance(jacobian * scale, names, free)
    covariance *= np.outer(scale, scale)
    errors = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlations = covariance / np.outer(errors, errors)
    correlations[~np.isfinite(correlations)] = 0.0
    np.fill_diagonal(correlations, 1.0)
    freedom = len(residuals) - len(names)
    if freedom <= 0:
        warnings.append(f"{len(residuals)} measured values determine {len(names)} unknowns without any check")
    bounded = [x.label for x in estimates if _at_bound(x)]
    if bounded:
        warnings.append(f"{', '.join(bounded)}: at a bound; the errors are those of the others with it fixed there")
    point = np.array([x.start for x in estimates])
    return Calibration(
        names, point, errors, correlations, noise, float(residuals @ residuals), freedom, tuple(warnings), fits,
        mechanism, estimates,
    )  # fmt: skip


def _at_bound(x: FreeValue) -> bool:
    return min(x.start - x.low, x.high - x.start) <= _AT_BOUND * x.scale


def _covariance(scaled: Floats, names: Sequence[str], free: Any) -> tuple[Floats, list[str]]:
    """The covariance (p, p) of the scaled values, and warnings; infinite on the diagonal of undetermined values."""
    sizes = np.linalg.norm(scaled, axis=0)
    idle = sizes <= SINGULAR * sizes.max(initial=0.0)
    warnings = [
        f"not identifiable: {names[i]} changes nothing that was measured; fix it" for i in np.flatnonzero(idle).tolist()
    ]
    columns = np.flatnonzero(free & ~idle)
    found = np.zeros((len(names), len(names)))
    part, said = _determined(scaled[:, columns], [names[i] for i in columns.tolist()])
    found[np.ix_(columns, columns)] = part
    found[idle, idle] = np.inf
    return found, [*warnings, *said]


def told(scaled: Floats) -> Floats:
    """The Jacobian ``scaled`` (n, p) without the directions that the data say nothing of, where rounding is left."""
    left, singular, rows = np.linalg.svd(scaled, full_matrices=False)
    singular[singular <= SINGULAR * singular.max(initial=0.0)] = 0.0
    return np.asarray((left * singular) @ rows)


def _determined(scaled: Floats, names: Sequence[str]) -> tuple[Floats, list[str]]:
    """The covariance and warnings where no column is zero; singular values find the directions that are undetermined.

    Source: Seber, Wild, Nonlinear Regression, section 3.4 (identifiability).
    """
    _, singular, rows = np.linalg.svd(scaled, full_matrices=len(scaled) < scaled.shape[1])
    sizes = np.zeros(len(rows))
    sizes[: len(singular)] = singular
    lost, found = np.zeros(len(names), dtype=bool), np.zeros((len(names), len(names)))
    warnings: list[str] = []
    for size, row in zip(sizes, rows, strict=True):
        takes_part = abs(row) >= _TAKES_PART * abs(row).max()
        told = _direction([names[i] for i in np.flatnonzero(takes_part).tolist()], row[takes_part])
        if size <= SINGULAR * sizes[0]:
            lost |= abs(row) > SINGULAR
            warnings.append(f"not identifiable: {told} changes nothing that was measured; fix one of them")
            continue
        found += np.outer(row, row) / size**2
        if size < 1.0:
            warnings.append(f"hardly identifiable: {told} is known to {100 / size:.3g} % of its size only")
    found[lost, lost] = np.inf
    return found, warnings


def _direction(names: Sequence[str], entries: Floats) -> str:
    """The names that move together along a direction, such as 'm with k' or 'l against g'; entries are relative."""
    if len(names) == 1:
        return names[0]
    entries = entries / entries[np.argmax(abs(entries))]
    listed = ", ".join(f"{entry:+.2g} {name}" for name, entry in zip(names, entries, strict=True))
    return f"the direction ({listed}), in parts of their sizes,"

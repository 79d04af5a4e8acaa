/** The coordinates that bring a spot of the picture to a given place, by damped least squares. */

const ROUNDS = 12;
const CONSTRAINTS = 1e3;
const REST = 1e-4;

/** A x = b for a symmetric, positive matrix of rows, by elimination; both are overwritten. */
function solve(matrix, b) {
  const n = b.length;
  for (let k = 0; k < n; k += 1) {
    for (let i = k + 1; i < n; i += 1) {
      const factor = matrix[i][k] / matrix[k][k];
      if (factor === 0) continue;
      for (let j = k; j < n; j += 1) matrix[i][j] -= factor * matrix[k][j];
      b[i] -= factor * b[k];
    }
  }
  for (let k = n - 1; k >= 0; k -= 1) {
    for (let j = k + 1; j < n; j += 1) b[k] -= matrix[k][j] * b[j];
    b[k] /= matrix[k][k];
  }
  return b;
}

/**
 * Moves the coordinates at the start so that `measure(spots)`, in units of the picture, becomes `target`.
 *
 * `first` is the index among the spots at which the residuals of the constraints begin. `nominals` are the sizes of the
 * coordinates. Among several solutions the one nearest to the previous coordinates is chosen. Returns the coordinates.
 * Source: the method of Levenberg and Marquardt.
 */
function reach(mechanism, target, measure, first, nominals) {
  const n = mechanism.coordinates;
  const q = mechanism.point;
  const begin = q.slice(0, n);
  const residuals = () => {
    const spots = mechanism.draw(0);
    const place = measure(spots).map((x, i) => x - target[i]);
    const constraints = Array.from(spots.subarray(first), (g) => CONSTRAINTS * g);
    const rest = nominals.map((size, i) => (REST * (q[i] - begin[i])) / size);
    return [...place, ...constraints, ...rest];
  };
  const square = (vector) => vector.reduce((sum, x) => sum + x * x, 0);
  let damping = 1e-3;
  let now = residuals();
  for (let round = 0; round < ROUNDS; round += 1) {
    const columns = nominals.map((size, j) => {
      const kept = q[j];
      q[j] += 1e-7 * size;
      const column = residuals().map((x, i) => (x - now[i]) / 1e-7);
      q[j] = kept;
      return column;
    });
    const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
    const matrix = columns.map((a) => columns.map((b) => dot(a, b)));
    matrix.forEach((row, i) => (row[i] += damping * (row[i] + 1e-12)));
    const step = solve(
      matrix,
      columns.map((a) => -dot(a, now)),
    );
    const kept = q.slice(0, n);
    step.forEach((x, i) => (q[i] += x * nominals[i]));
    const next = residuals();
    const better = square(next) < square(now);
    if (!better) q.set(kept);
    damping *= better ? 0.2 : 8;
    const small = Math.max(...step.map(Math.abs)) < 1e-9;
    if (better) now = next;
    if (small) break;
  }
  return q.slice(0, n);
}

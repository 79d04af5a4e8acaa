/** The balance of energy of a run: the gain of energy minus the work of everything that changes it. */

/** Gauss's rule of three points on [0, 1], exact for polynomials through six points: [place, weight]. */
const GAUSS = [-1, 0, 1].map((side) => [(1 + side * Math.sqrt(0.6)) / 2, side === 0 ? 4 / 9 : 5 / 18]);
const MOST_POINTS = 6;
const NARROW = 0.25;

/**
 * The balance at every record, J: the generalized energy, minus its value at the start, minus the work done since, plus
 * the value of the variable `taken` (dissipated energy), if there is one. The balance is 0 but for errors. When a
 * variable is set, or a support moves in an impact, the work is the change of the energy.
 */
function balance(run, energy, taken) {
  const worth = (values) => values[energy.index] + (taken ? values[taken.index] : 0);
  const given = run.instants.filter((instant) => instant.set || instant.before.moving);
  const work = works(run);
  let [next, known] = [0, worth(run.values[0])];
  return run.values.map((values, record) => {
    for (; given[next]?.index <= record; next += 1) {
      known += worth(given[next].after.values) - worth(given[next].before.values);
    }
    return worth(values) - known - work[record];
  });
}

/** The work up to each record, J. */
function works(run) {
  const found = [];
  let before = 0;
  for (const points of stretches(run)) {
    let sum = before;
    points.forEach((point, i) => {
      if (i > 0) sum += integral(points, i - 1, run.timeOf(1));
      if (point.record !== undefined) found[point.record] = sum;
    });
    before = sum;
  }
  return found;
}

/** Lists of points {time, power, record} between instants at which the power may jump; an instant has no record. */
function* stretches(run) {
  let [points, next] = [[{ time: 0, power: run.powers[0], record: 0 }], 0];
  const reach = (point) => {
    if (point.time > points.at(-1).time) points.push(point);
    else if (point.record !== undefined) points.at(-1).record = point.record;
  };
  for (let record = 1; record < run.powers.length; record += 1) {
    for (; run.instants[next]?.index <= record; next += 1) {
      const { time, before, after } = run.instants[next];
      reach({ time, power: before.power });
      yield points;
      points = [{ time, power: after.power }];
    }
    reach({ time: run.timeOf(record), power: run.powers[record], record });
  }
  yield points;
}

/**
 * The integral of the power from point k to k + 1, J, by the polynomial through the nearest points. An end point that
 * is much nearer to its neighbour than a `step` is left out, because it would make the polynomial oscillate.
 */
function integral(points, k, step) {
  const last = points.length - 1;
  const length = (i) => points[i + 1].time - points[i].time;
  const narrow = (i) => length(i) < NARROW * step;
  if (narrow(k)) return (length(k) * (points[k].power + points[k + 1].power)) / 2;
  const [low, high] = [narrow(0) ? 1 : 0, narrow(last - 1) ? last - 1 : last];
  const count = Math.min(MOST_POINTS, high - low + 1);
  const first = Math.max(low, Math.min(k - MOST_POINTS / 2 + 1, high - count + 1));
  const near = points.slice(first, first + count);
  const value = (time) => near.reduce((sum, point) => sum + point.power * lagrange(near, point, time), 0);
  return (
    length(k) * GAUSS.reduce((sum, [place, weight]) => sum + weight * value(points[k].time + place * length(k)), 0)
  );
}

/** Lagrange's polynomial that is 1 at `one` of the points and 0 at the others, at a time. */
function lagrange(points, one, time) {
  let product = 1;
  for (const { time: other } of points) if (other !== one.time) product *= (time - other) / (one.time - other);
  return product;
}

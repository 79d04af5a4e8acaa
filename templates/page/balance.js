/** The balance of energy of a run: what the energy has gained beyond the work of all that changes it. */

/** Gauss's rule of three points on [0, 1], exact for polynomials through six points: [place, weight]. */
const GAUSS = [-1, 0, 1].map((side) => [(1 + side * Math.sqrt(0.6)) / 2, side === 0 ? 4 / 9 : 5 / 18]);
const MOST_POINTS = 6;
const NARROW = 0.25;

/**
 * The balance at every record, J: the generalized energy less that of the start and the work done since, with the energy
 * that a variable says is `taken`, if there is one. It is 0 but for errors. Setting a variable does the work that it
 * changes the energy by, and so does a support that moves in an impact.
 */
export function balance(run, energy, taken) {
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
 * The integral of the power from point k to k + 1, J, by the polynomial through the nearest points. A point at an end
 * that is much nearer to the next one than a `step` would make the polynomial waver.
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

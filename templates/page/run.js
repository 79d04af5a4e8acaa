/** A run of the experiment, which is computed ahead of the shown time and recorded at every communication point. */

const MOST_SNAPSHOTS = 400;

/** Counts the changes of all runs, so that no two states of runs have the same version. */
let changes = 0;

class Run {
  /**
   * `experiment`: stop, step and tolerance; `settings`: a Map of variables to values at the start; `watched`: the
   * variables that change at events only.
   */
  constructor(mechanism, experiment, settings, watched) {
    Object.assign(this, { mechanism, experiment, settings: new Map(settings), watched });
    this.count = Math.max(1, Math.round(experiment.stop / experiment.step));
    this.every = Math.ceil(this.count / MOST_SNAPSHOTS);
    this.restart();
  }

  restart() {
    Object.assign(this, { points: [], values: [], powers: [], snapshots: [], marks: [], instants: [], error: "" });
    this.moved();
    this.begun = (this.begun ?? 0) + 1;
    if (this.mechanism.begin(this.experiment, this.settings)) {
      this.record(true);
    } else {
      this.error = this.mechanism.sentence;
    }
  }

  /** The records of the communication points: x, u and p; values of variables; power; at some, the saved state. */
  get records() {
    return [this.points, this.values, this.powers, this.snapshots];
  }

  moved() {
    changes += 1;
    this.version = changes;
  }

  /** The time of the record with this index, s. */
  timeOf(index) {
    return index * (this.experiment.stop / this.count);
  }

  /** The time up to which the run is computed, s. */
  get end() {
    return this.timeOf(Math.max(0, this.points.length - 1));
  }

  get done() {
    return this.error !== "" || this.points.length > this.count;
  }

  record(kept) {
    const index = this.points.length;
    const { values, power } = this.mechanism.observe();
    if (index > 0) this.mark(index, this.values[index - 1], values);
    this.points.push(this.mechanism.point.slice());
    this.values.push(values);
    this.powers.push(power);
    this.snapshots.push(kept || index % this.every === 0 ? this.mechanism.state.slice() : null);
  }

  mark(index, before, after) {
    for (const variable of this.watched) {
      const [a, b] = [before[variable.index], after[variable.index]];
      if (a !== b) this.marks.push({ index, time: this.timeOf(index), variable, value: b });
    }
  }

  /** Goes on computing for some milliseconds, or to a time; returns whether a record was added. */
  compute(milliseconds, until = Infinity) {
    const begin = performance.now();
    const before = this.points.length;
    while (!this.done && this.end < until) {
      if (!this.step()) {
        this.error = this.mechanism.sentence;
        break;
      }
      this.record(false);
      if (performance.now() - begin > milliseconds) break;
    }
    if (this.points.length > before) this.moved();
    return this.points.length > before;
  }

  /** Goes on to the next record, over the events before it; returns whether that was possible. */
  step() {
    const index = this.points.length;
    let reached = this.mechanism.advance(this.timeOf(index));
    while (reached === "event") {
      const [time, before] = [this.mechanism.time, this.mechanism.observe()];
      if (!this.mechanism.pass()) return false;
      this.instants.push({ index, time, before, after: this.mechanism.observe(), set: false });
      reached = this.mechanism.advance(this.timeOf(index));
    }
    return reached;
  }

  /** Deletes the records after `index` and returns to the state of this record. */
  goBack(index) {
    let known = index;
    while (this.snapshots[known] === null) known -= 1;
    this.mechanism.restore(this.snapshots[known]);
    for (const list of this.records) list.length = known + 1;
    this.marks = this.marks.filter((mark) => mark.index <= known);
    this.instants = this.instants.filter((instant) => instant.index <= known);
    this.error = "";
    this.begun += 1;
    while (this.points.length <= index && !this.done) this.compute(0);
  }

  /** Gives a variable another value from a time on. At the start this changes a start value, and the constraints are
   *  solved again. */
  change(variable, value, time) {
    const index = Math.min(Math.floor(time / this.timeOf(1) + 1e-9), this.points.length - 1);
    if (index <= 0) {
      this.settings.set(variable, value);
      this.restart();
      return;
    }
    this.goBack(index);
    this.mechanism.set(variable, value);
    const [, values, power] = this.records.map((list) => list.pop());
    this.marks = this.marks.filter((mark) => mark.index < index);
    this.record(true);
    const after = { values: this.values[index], power: this.powers[index] };
    this.instants.push({ index, time: this.timeOf(index), before: { values, power }, after, set: true });
    this.moved();
  }

  /** Sets the mechanism to the point at a time. Between two records the positions are Hermite's cubic through their
   *  positions and velocities. */
  pose(time) {
    const step = this.timeOf(1);
    const index = Math.max(0, Math.min(Math.floor(time / step), this.points.length - 1));
    const [a, b] = [this.points[index], this.points[index + 1] ?? this.points[index]];
    const s = Math.min(1, Math.max(0, time / step - index));
    const n = this.mechanism.coordinates;
    const point = this.mechanism.point;
    point.set(a);
    if (s > 1e-9) {
      const [h00, h10] = [(1 + 2 * s) * (1 - s) ** 2, s * (1 - s) ** 2 * step];
      const [h01, h11] = [s * s * (3 - 2 * s), s * s * (s - 1) * step];
      for (let i = 0; i < n; i += 1) {
        point[i] = h00 * a[i] + h10 * a[n + i] + h01 * b[i] + h11 * b[n + i];
        point[n + i] = a[n + i] + s * (b[n + i] - a[n + i]);
      }
    }
    return this.mechanism.draw(time);
  }

  /** The value of a variable at a time, linear between records. */
  valueAt(variable, time) {
    const step = this.timeOf(1);
    const index = Math.max(0, Math.min(Math.floor(time / step + 1e-9), this.values.length - 1));
    const [a, b] = [this.values[index], this.values[index + 1] ?? this.values[index]];
    if (variable.discrete) return a[variable.index];
    const share = Math.min(1, Math.max(0, time / step - index));
    return a[variable.index] + share * (b[variable.index] - a[variable.index]);
  }

  column(variable) {
    return this.values.map((row) => row[variable.index]);
  }

  times() {
    return this.values.map((_, index) => this.timeOf(index));
  }
}

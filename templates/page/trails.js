/** The trails of the bodies: their places a short time before. */

const POINTS = 160;
const SHARE = 0.12;
const MOST = 8;

/** The trails of a page: they reach over a part of the run. */
class Trails {
  constructor(page) {
    this.page = page;
    this.forget(null);
  }

  forget(run) {
    Object.assign(this, { run, last: -1, known: new Map() });
  }

  /** A list of places, oldest first, for each body. */
  until(run, time) {
    const { view, mechanism, drawing } = this.page;
    const last = Math.floor(time / run.timeOf(1));
    const stride = Math.max(1, Math.ceil((SHARE * run.count) / POINTS));
    const first = Math.max(0, last - stride * POINTS);
    if (this.run !== run || last < this.last || this.begun !== run.begun) this.forget(run);
    const spots = drawing.handles.slice(0, MOST).map(([, spot]) => spot);
    for (let k = Math.ceil(first / stride) * stride; k <= last && k < run.points.length; k += stride) {
      if (this.known.has(k)) continue;
      mechanism.point.set(run.points[k]);
      this.known.set(k, view.places(mechanism.draw(run.timeOf(k)), spots));
    }
    for (const k of this.known.keys()) if (k < first) this.known.delete(k);
    Object.assign(this, { last, begun: run.begun });
    const rows = [...this.known.keys()].sort((a, b) => a - b).map((k) => this.known.get(k));
    const here = view.places(run.pose(time), spots);
    return spots.map((_, i) => [...rows.map((row) => row[i]), here[i]]);
  }
}

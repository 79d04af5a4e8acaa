/** Plots of a run: variables over the time by uPlot, and one variable over another. */

/* global uPlot */

const HEIGHT = 210;

/** The short texts of an axis' ticks: 2e-5 and not 2.00e-5. */
const short = (ticks) => ticks.map((x) => number(x).replace(/\.?0*e/, "e"));

const number = (x) => {
  if (x === null || x === undefined || !Number.isFinite(x)) return "–";
  const size = Math.abs(x);
  return size !== 0 && (size < 1e-3 || size >= 1e5) ? x.toExponential(2) : String(Number(x.toPrecision(4)));
};

/** Variables over the time in `host`; `series`: [{label, color, dash}]. */
class TimePlot {
  constructor(host, series, colors, seek) {
    Object.assign(this, { host, colors, marks: [] });
    const axis = { stroke: () => colors("text"), grid: { stroke: () => colors("grid"), width: 1 }, size: 54 };
    axis.ticks = { stroke: () => colors("grid"), size: 4 };
    axis.font = "12px system-ui, sans-serif";
    const time = { ...axis, size: 30, values: (_, ticks) => short(ticks) };
    const lines = series.map((s) => ({
      label: s.label,
      stroke: () => colors(s.color),
      width: s.grey ? 1 : 1.6,
      points: { show: false },
      dash: s.grey ? [5, 4] : undefined,
      value: (_, x) => number(x),
    }));
    this.plot = new uPlot(
      {
        width: Math.max(200, host.clientWidth),
        height: HEIGHT,
        scales: { x: { time: false } },
        cursor: { drag: { x: false, y: false }, points: { size: 6 } },
        legend: { live: true, markers: { width: 3 } },
        axes: [time, { ...axis, values: (_, ticks) => short(ticks) }],
        series: [{ label: "t / s", value: (_, x) => number(x) }, ...lines],
        hooks: { draw: [(plot) => this.drawMarks(plot)] },
      },
      [[0], ...series.map(() => [null])],
      host,
    );
    this.line = document.createElement("div");
    this.line.className = "playhead";
    this.plot.over.append(this.line);
    this.plot.over.addEventListener("click", (event) => {
      if (this.plot.cursor.left >= 0) seek(this.plot.posToVal(event.offsetX, "x"));
    });
  }

  show(columns, stop, marks) {
    this.marks = marks;
    this.plot.batch(() => {
      this.plot.setData(columns, false);
      this.plot.setScale("x", { min: 0, max: stop });
    });
  }

  drawMarks(plot) {
    const c = plot.ctx;
    const { top, height } = plot.bbox;
    c.save();
    c.strokeStyle = this.colors("mark");
    c.lineWidth = 1;
    c.beginPath();
    for (const mark of this.marks) {
      const x = Math.round(plot.valToPos(mark.time, "x", true)) + 0.5;
      c.moveTo(x, top);
      c.lineTo(x, top + height);
    }
    c.stroke();
    c.restore();
  }

  /** Marks the time, and shows the values at this time unless the mouse points at another one. */
  at(time, index) {
    if (!(this.plot.cursor.left >= 0)) this.plot.setLegend({ idx: index }, false);
    this.line.style.transform = `translateX(${this.plot.valToPos(time, "x")}px)`;
  }

  resize() {
    this.plot.setSize({ width: Math.max(200, this.host.clientWidth), height: HEIGHT });
  }

  destroy() {
    this.plot.destroy();
  }
}

/** One variable over another on a canvas. */
class PhasePlot {
  constructor(canvas, colors) {
    Object.assign(this, { canvas, colors });
    this.context = canvas.getContext("2d");
  }

  show(xs, ys, grey, labels) {
    Object.assign(this, { xs, ys, grey, labels });
    this.path = null;
  }

  fit() {
    const ratio = window.devicePixelRatio || 1;
    const { canvas } = this;
    const [width, height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio].map(Math.round);
    if (canvas.width !== width || canvas.height !== height) {
      Object.assign(canvas, { width, height });
      this.path = null;
    }
    if (this.path) return;
    const all = (mine, theirs) => (theirs ? mine.concat(theirs) : mine).filter(Number.isFinite);
    this.x = range(all(this.xs, this.grey?.xs));
    this.y = range(all(this.ys, this.grey?.ys));
    const [left, right, top, bottom] = [52, 10, 10, 34].map((x) => x * ratio);
    const across = (x) => left + ((x - this.x[0]) / (this.x[1] - this.x[0])) * (width - left - right);
    const up = (y) => height - bottom - ((y - this.y[0]) / (this.y[1] - this.y[0])) * (height - top - bottom);
    Object.assign(this, { ratio, across, up, frame: [left, top, width - right, height - bottom] });
    const line = (xs, ys) => {
      const path = new Path2D();
      xs.forEach((x, i) => (i === 0 ? path.moveTo(across(x), up(ys[i])) : path.lineTo(across(x), up(ys[i]))));
      return path;
    };
    this.path = line(this.xs, this.ys);
    this.greyPath = this.grey ? line(this.grey.xs, this.grey.ys) : null;
  }

  /** Draws the curve with a dot at [x, y], and one at `there` for the grey run. */
  draw(here, there) {
    if (!this.xs) return;
    this.fit();
    const c = this.context;
    c.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.axes();
    c.lineWidth = 1.3 * this.ratio;
    if (this.greyPath) {
      c.strokeStyle = this.colors("grey");
      c.stroke(this.greyPath);
    }
    c.strokeStyle = this.colors("series0");
    c.stroke(this.path);
    this.dot(there, "grey");
    this.dot(here, "load");
  }

  dot(place, style) {
    if (!place) return;
    const c = this.context;
    c.fillStyle = this.colors(style);
    c.beginPath();
    c.arc(this.across(place[0]), this.up(place[1]), 4.5 * this.ratio, 0, 2 * Math.PI);
    c.fill();
  }

  axes() {
    const c = this.context;
    const [left, top, right, bottom] = this.frame;
    c.font = `${12 * this.ratio}px system-ui, sans-serif`;
    c.fillStyle = this.colors("text");
    c.strokeStyle = this.colors("grid");
    c.lineWidth = this.ratio;
    c.beginPath();
    c.textAlign = "center";
    for (const x of ticks(...this.x)) {
      c.moveTo(this.across(x), top);
      c.lineTo(this.across(x), bottom);
      c.fillText(short([x])[0], this.across(x), bottom + 15 * this.ratio);
    }
    c.textAlign = "right";
    for (const y of ticks(...this.y)) {
      c.moveTo(left, this.up(y));
      c.lineTo(right, this.up(y));
      c.fillText(short([y])[0], left - 6 * this.ratio, this.up(y) + 4 * this.ratio);
    }
    c.stroke();
    c.fillText(this.labels[0], right, bottom + 30 * this.ratio);
    c.textAlign = "left";
    c.fillText(this.labels[1], left + 6 * this.ratio, top + 12 * this.ratio);
  }
}

function range(values) {
  const [least, most] = values.reduce(([a, b], x) => [Math.min(a, x), Math.max(b, x)], [Infinity, -Infinity]);
  if (!(most >= least)) return [-1, 1];
  const room = most > least ? 0.06 * (most - least) : Math.max(1e-9, 0.1 * Math.abs(most)) || 1;
  return [least - room, most + room];
}

/** Round numbers between two values. */
function ticks(least, most) {
  const rough = (most - least) / 5;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((x) => x * power).find((x) => x >= rough);
  const found = [];
  for (let x = Math.ceil(least / step) * step; x <= most; x += step) found.push(Math.abs(x) < step / 1e6 ? 0 : x);
  return found;
}

/** The mechanism on a canvas, in its plane. */

const MARGIN = 9;
const LEAST = 3.4;
const FAR = 520;

/** Draws a drawing; `colors(name)` gives the colour of a style. */
class PlaneView {
  constructor(canvas, drawing, colors) {
    Object.assign(this, { canvas, drawing, colors });
    this.forget();
  }

  /** Forgets how far the mechanism moves. */
  forget() {
    this.box = [Infinity, Infinity, -Infinity, -Infinity];
    this.largest = 0;
    for (const item of this.drawing.items) item.span = undefined;
  }

  /** Extends the view to the parts that are drawn at these spots. */
  include(spots) {
    const moment = new Moment(this.drawing, spots);
    for (const item of this.drawing.items) {
      for (const [x, y] of this.outline(moment, item)) this.widen(x, y);
    }
  }

  outline(moment, item) {
    if (item.k === "still") return item.lines.flat();
    if (item.k === "rail") return this.along(moment, item);
    if (item.k === "pulley") return this.hung(moment, item.tree);
    const found = item.at === undefined ? [] : [moment.flat(item.at)];
    if (item.size) {
      const reach = Math.max(...moment.size(item)) / this.drawing.unit;
      const [x, y] = found[0];
      found.push([x - reach, y - reach], [x + reach, y + reach]);
    }
    if (item.wall || item.link) return [moment.ends(item).b];
    if (item.ends && item.k === "link") found.push(...item.ends.map((spot) => moment.flat(spot)));
    return found;
  }

  /** Both ends of a rail, which is made longer if its slider has left it. */
  along(moment, item) {
    const [x, y] = moment.flat(item.of);
    const station = (x - item.middle[0]) * item.along[0] + (y - item.middle[1]) * item.along[1];
    const [least, most] = item.span ?? [0, 0];
    if (Number.isFinite(station) && Math.abs(station) < FAR) {
      item.span = [Math.min(least, station), Math.max(most, station)];
    }
    return railEnds(item);
  }

  hung(moment, tree) {
    return tree
      .flatMap((end) => (Array.isArray(end) ? this.hung(moment, end) : [moment.flat(end)]))
      .map(([x, y]) => [x, y + 30]);
  }

  widen(x, y) {
    if (!Number.isFinite(x) || !Number.isFinite(y)) return;
    const b = this.box;
    b.splice(0, 4, Math.min(b[0], x), Math.min(b[1], y), Math.max(b[2], x), Math.max(b[3], y));
  }

  /** Fits the included parts into the canvas; the view follows parts that go far away. */
  fit(moment) {
    const ratio = window.devicePixelRatio || 1;
    const { clientWidth, clientHeight } = this.canvas;
    const [width, height] = [Math.round(clientWidth * ratio), Math.round(clientHeight * ratio)];
    if (this.canvas.width !== width || this.canvas.height !== height) {
      Object.assign(this.canvas, { width, height });
    }
    let [left, bottom, right, top] = this.box;
    if (Math.max(right - left, top - bottom) > FAR) {
      [left, bottom, right, top] = this.around(moment);
    }
    const wide = right - left + 2 * MARGIN;
    const high = top - bottom + 2 * MARGIN;
    this.scale = Math.min(width / wide, height / high, 9 * ratio);
    this.size = Math.max(1, (LEAST * ratio) / this.scale);
    this.center = [(left + right) / 2, (bottom + top) / 2];
    this.ratio = ratio;
  }

  around(moment) {
    const spots = this.drawing.handles.map(([, spot]) => moment.flat(spot));
    const [xs, ys] = [spots.map((p) => p[0]), spots.map((p) => p[1])];
    const [x, y] = [xs, ys].map((all) => (Math.min(...all) + Math.max(...all)) / 2);
    const spread = Math.max(Math.max(...xs) - Math.min(...xs), Math.max(...ys) - Math.min(...ys));
    this.largest = Math.max(this.largest, spread / 2 + 45);
    return [x - this.largest, y - this.largest, x + this.largest, y + this.largest];
  }

  toPixels([x, y]) {
    return [
      this.canvas.width / 2 + this.scale * (x - this.center[0]),
      this.canvas.height / 2 - this.scale * (y - this.center[1]),
    ];
  }

  /** The place in the picture under a point of the canvas, in pixels of the page. */
  fromPixels(x, y) {
    return [
      (x * this.ratio - this.canvas.width / 2) / this.scale + this.center[0],
      (this.canvas.height / 2 - y * this.ratio) / this.scale + this.center[1],
    ];
  }

  /** The handle [name, spot] at this place, or null; `reach` in pixels. */
  handleAt(x, y, spots, reach = 28) {
    const moment = new Moment(this.drawing, spots);
    const at = this.fromPixels(x, y);
    const distances = this.drawing.handles.map(([, spot]) => {
      const [a, b] = moment.flat(spot);
      return Math.hypot(a - at[0], b - at[1]);
    });
    const nearest = distances.indexOf(Math.min(...distances));
    return (distances[nearest] * this.scale) / this.ratio <= reach ? this.drawing.handles[nearest] : null;
  }

  /** The quantity that a dragged handle brings to a target, and the target. */
  measure(spot) {
    return (spots) => new Moment(this.drawing, spots).flat(spot);
  }

  target(x, y) {
    return this.fromPixels(x, y);
  }

  /** The places of these spots in the picture. */
  places(spots, wanted) {
    const moment = new Moment(this.drawing, spots);
    return wanted.map((spot) => moment.flat(spot));
  }

  /** `shown`: spots, trail (lists of places of spots), names; `grey`: spots of another run or null. */
  draw(shown) {
    const moment = new Moment(this.drawing, shown.spots);
    this.fit(moment);
    this.context ??= this.canvas.getContext("2d");
    const c = this.context;
    c.clearRect(0, 0, this.canvas.width, this.canvas.height);
    c.lineJoin = c.lineCap = "round";
    for (const line of shown.trails) this.trail(line);
    if (shown.grey) {
      c.globalAlpha = 0.28;
      this.items(new Moment(this.drawing, shown.grey), true);
      c.globalAlpha = 1;
    }
    this.items(moment, false);
    this.names(moment);
  }

  trail(line) {
    const c = this.context;
    c.strokeStyle = this.colors("trail");
    c.lineWidth = 1.5 * this.ratio;
    const pieces = 12;
    for (let k = 0; k < pieces; k += 1) {
      const part = line.slice(Math.floor((k * line.length) / pieces), Math.floor(((k + 1) * line.length) / pieces) + 1);
      c.globalAlpha = (0.55 * (k + 1)) / pieces;
      this.stroke(part);
    }
    c.globalAlpha = 1;
  }

  items(moment, grey) {
    for (const item of this.drawing.items) {
      if (grey && ["still", "rail", "support"].includes(item.k)) continue;
      PARTS[item.k](this, moment, item);
    }
  }

  path(line) {
    const c = this.context;
    c.beginPath();
    line.forEach((point, k) => (k === 0 ? c.moveTo(...this.toPixels(point)) : c.lineTo(...this.toPixels(point))));
  }

  stroke(line) {
    this.path(line);
    this.context.stroke();
  }

  pen(style, width) {
    this.context.strokeStyle = this.colors(style);
    this.context.lineWidth = width * this.size * this.scale;
  }

  lines(lines, style, width) {
    this.pen(style, width);
    for (const line of lines) this.stroke(line);
  }

  shape(line, fill, style, width) {
    this.path(line);
    this.context.closePath();
    this.context.fillStyle = this.colors(fill);
    this.context.fill();
    this.pen(style, width);
    this.context.stroke();
  }

  disc(center, radius, fill, style, width = 0.4) {
    const c = this.context;
    c.beginPath();
    c.arc(...this.toPixels(center), Math.max(0, radius * this.scale), 0, 2 * Math.PI);
    c.fillStyle = this.colors(fill);
    c.fill();
    if (width === 0) return;
    this.pen(style, width);
    c.stroke();
  }

  names(moment) {
    const c = this.context;
    c.font = `${12 * this.ratio}px system-ui, sans-serif`;
    c.fillStyle = this.colors("text");
    for (const item of this.drawing.items) {
      if (!item.label || !item.name) continue;
      const [x, y] = this.toPixels(moment.flat(item.at));
      const beside = (item.half ? item.half[0] : (item.r ?? 1.5) * (item.real ? 1 : this.size)) * this.scale;
      c.fillText(item.name, x + beside + 5 * this.ratio, y - beside * 0.4 - 5 * this.ratio);
    }
  }
}

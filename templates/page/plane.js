/** The mechanism on a canvas, in its plane. */

import { arc, arrow, axesOf, cross, hatched, off, pot, spiral, support, zigzag } from "./glyphs.js";
import { Moment } from "./scene.js";

const MARGIN = 9;
const LEAST = 3.4;
const FAR = 520;

/** Draws a drawing; `colors(name)` gives the colour of a style. */
export class PlaneView {
  constructor(canvas, drawing, colors) {
    Object.assign(this, { canvas, drawing, colors });
    this.context = canvas.getContext("2d");
    this.forget();
  }

  /** Nothing is known any more of how far the mechanism goes. */
  forget() {
    this.box = [Infinity, Infinity, -Infinity, -Infinity];
    this.largest = 0;
  }

  /** Makes room for what is drawn at these spots. */
  include(spots) {
    const moment = new Moment(this.drawing, spots);
    for (const item of this.drawing.items) {
      for (const [x, y] of this.outline(moment, item)) this.widen(x, y);
    }
  }

  outline(moment, item) {
    if (item.k === "still") return item.lines.flat();
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

  hung(moment, tree) {
    return tree.flatMap((end) => (Array.isArray(end) ? this.hung(moment, end) : [moment.flat(end)]))
      .map(([x, y]) => [x, y + 30]);
  }

  widen(x, y) {
    if (!Number.isFinite(x) || !Number.isFinite(y)) return;
    const b = this.box;
    b.splice(0, 4, Math.min(b[0], x), Math.min(b[1], y), Math.max(b[2], x), Math.max(b[3], y));
  }

  /** Fits what was included into the canvas; what goes far away is followed. */
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

  /** Which handle is there, as [name, spot], or null; `reach` in pixels. */
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

  /** What is to be brought to the target while a handle is dragged, and the target. */
  measure(spot) {
    return (spots) => new Moment(this.drawing, spots).flat(spot);
  }

  target(x, y) {
    return this.fromPixels(x, y);
  }

  /** Where these spots are in the picture. */
  places(spots, wanted) {
    const moment = new Moment(this.drawing, spots);
    return wanted.map((spot) => moment.flat(spot));
  }

  /** `shown`: spots, trail (lists of places of spots), names; `grey`: spots of another run or null. */
  draw(shown) {
    const moment = new Moment(this.drawing, shown.spots);
    this.fit(moment);
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
      if (grey && (item.k === "still" || item.k === "support")) continue;
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
      const beside = (item.half ? item.half[0] : (item.r ?? 1.5)) * this.size * this.scale;
      c.fillText(item.name, x + beside + 5 * this.ratio, y - beside * 0.4 - 5 * this.ratio);
    }
  }
}

const flatAxes = (view, moment, item) =>
  moment.axes(item).map((axis) => moment.flatVector(axis.map((x) => x * view.drawing.unit)));

/** How each kind of part is drawn. */
const PARTS = {
  still: (view, _, item) => view.lines(item.lines, "ground", 0.35),
  support: (view, moment, item) => view.lines(support(moment.flat(item.at), view.size), "ground", 0.35),
  cross: (view, moment, item) => view.lines(cross(moment.flat(item.at), view.size), "axis", 0.3),
  link(view, moment, item) {
    view.context.setLineDash(item.style === "guide" ? [4 * view.ratio, 4 * view.ratio] : []);
    view.lines([item.ends.map((spot) => moment.flat(spot))], item.style, item.style === "guide" ? 0.35 : 0.9);
    view.context.setLineDash([]);
  },
  joint: (view, moment, item) => view.disc(moment.flat(item.at), item.r * view.size, "paper", "link"),
  particle: (view, moment, item) => view.disc(moment.flat(item.at), item.r * view.size, "mass", "edge"),
  slider(view, moment, item) {
    const across = [-item.along[1], item.along[0]];
    const [a, b] = item.half.map((x) => x * view.size);
    const at = moment.flat(item.at);
    const corner = (x, y) => off(at, item.along, x * a, across, y * b);
    view.shape([corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)], "body", "edge", 0.5);
  },
  rod(view, moment, item) {
    const [along] = flatAxes(view, moment, item);
    const reach = moment.size(item)[0] / view.drawing.unit;
    const at = moment.flat(item.at);
    const line = [off(at, along, -reach), off(at, along, reach)];
    view.lines([line], "edge", 2.7);
    view.lines([line], "rod", 1.9);
    view.disc(at, 0.7 * view.size, "edge", "edge", 0);
  },
  disc(view, moment, item) {
    const [normal, first] = flatAxes(view, moment, item);
    const radius = moment.size(item)[0] / view.drawing.unit;
    const at = moment.flat(item.at);
    void normal;
    view.disc(at, radius, "body", "edge", 0.5);
    view.lines([[at, off(at, first, radius)]], "edge", 0.5);
    view.disc(at, 0.7 * view.size, "edge", "edge", 0);
  },
  ball(view, moment, item) {
    const at = moment.flat(item.at);
    const radius = Math.max(moment.size(item)[0] / view.drawing.unit, 1.6 * view.size);
    view.disc(at, radius, "body", "edge", 0.5);
    const [first] = item.frame ? flatAxes(view, moment, item) : [[0, 0]];
    view.lines([[at, off(at, first, radius)]], "edge", 0.4);
    view.disc(at, 0.7 * view.size, "edge", "edge", 0);
  },
  cuboid(view, moment, item) {
    const axes = flatAxes(view, moment, item);
    const at = moment.flat(item.at);
    const half = item.size.map((x) => x / view.drawing.unit);
    const corners = [];
    for (const a of [-1, 1]) for (const b of [-1, 1]) for (const d of [-1, 1]) {
      corners.push(off(off(at, axes[0], a * half[0], axes[1], b * half[1]), axes[2], d * half[2]));
    }
    view.shape(hull(corners), "body", "edge", 0.5);
  },
  spring(view, moment, item) {
    if (item.hinge !== undefined) {
      view.lines(spiral(moment.flat(item.hinge), item.reach * view.size), "spring", 0.5);
      return;
    }
    const { a, b, wall } = moment.ends(item);
    if (wall) view.wall(a, b);
    view.lines(zigzag(a, b, view.size), "spring", 0.55);
  },
  damper(view, moment, item) {
    if (item.hinge !== undefined) {
      const line = arc(moment.flat(item.hinge), 0.8 * item.reach * view.size, 0, 6.2832)[0];
      view.lines([line], "damper", 0.5);
      return;
    }
    const { a, b, wall } = moment.ends(item);
    if (wall) view.wall(a, b);
    view.lines(pot(a, b, view.size), "damper", 0.55);
  },
  load(view, moment, item) {
    const at = moment.flat(item.at);
    if (item.torque && !item.frame) {
      const value = moment.world(item.vector)[0];
      if (value !== 0) {
        const ends = value > 0 ? [-0.6, 0.8 + Math.min(1.6, Math.abs(value))] : [0.6, -0.8 - Math.min(1.6, -value)];
        view.lines(arc(at, 5.5 * view.size, ...ends), "load", 0.6);
      }
      return;
    }
    const vector = moment.flatVector(moment.world(item.vector).map((x) => x * view.drawing.unit));
    const force = Math.hypot(...vector);
    if (!(force > 1e-9)) return;
    item.most = Math.max(item.most ?? 0, force);
    const along = vector.map((x) => x / force);
    const start = off(at, along, (item.half || 2) * view.size);
    const [shaft, head] = arrow(start, off(start, along, (4 + (12 * force) / item.most) * view.size), 2.2 * view.size);
    view.lines([shaft], "load", 0.7);
    view.shape(head, "load", "load", 0.3);
  },
  pulley(view, moment, item) {
    const { center, radius } = hang(view, moment, item.tree, item.height * view.size);
    const top = [center[0], center[1] + radius + 3];
    view.lines([[center, top]], "link", 0.7);
    view.lines(hatched([top[0] + radius, top[1]], [top[0] - radius, top[1]]), "ground", 0.35);
  },
};

PlaneView.prototype.wall = function wall(a, b) {
  const { across } = axesOf(a, b);
  const reach = 3.2 * this.size;
  this.lines(hatched(off(b, across, -reach), off(b, across, reach), this.size), "ground", 0.35);
};

/** Draws a pulley with all that hangs on it; answers its centre and radius. */
function hang(view, moment, tree, height) {
  const tops = tree.map((end) => {
    if (!Array.isArray(end)) return { at: off(moment.flat(end), [0, 1], height), radius: 0 };
    const { center, radius } = hang(view, moment, end, height);
    return { at: center, radius };
  });
  const radius = (tops[1].at[0] - tops[0].at[0]) / 2;
  const highest = Math.max(...tops.map((top) => top.at[1] + top.radius));
  const center = [(tops[0].at[0] + tops[1].at[0]) / 2, highest + radius + 3];
  view.disc(center, radius, "body", "edge", 0.5);
  tops.forEach((top, k) => view.lines([[top.at, [center[0] + (2 * k - 1) * radius, center[1]]]], "link", 0.45));
  view.disc(center, 0.8, "paper", "link");
  return { center, radius };
}

/** The corners of the convex hull, in order; Andrew's monotone chain. */
function hull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const turn = (o, a, b) => (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
  const half = (list) => {
    const chain = [];
    for (const point of list) {
      while (chain.length > 1 && turn(chain.at(-2), chain.at(-1), point) <= 0) chain.pop();
      chain.push(point);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

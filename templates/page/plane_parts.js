/** How the parts of a drawing look in the plane. */

const flatAxes = (view, moment, item) =>
  moment.axes(item).map((axis) => moment.flatVector(axis.map((x) => x * view.drawing.unit)));

/** How each kind of part is drawn. */
const PARTS = {
  still: (view, _, item) => view.lines(item.lines, "ground", 0.35),
  rail(view, _, item) {
    const [least, most] = railEnds(item);
    view.lines(hatched(least, most), "ground", 0.35);
  },
  support: (view, moment, item) => view.lines(support(moment.flat(item.at), view.size), "ground", 0.35),
  cross: (view, moment, item) => view.lines(cross(moment.flat(item.at), view.size), "axis", 0.3),
  link(view, moment, item) {
    view.context.setLineDash(item.style === "guide" ? [4 * view.ratio, 4 * view.ratio] : []);
    view.lines([item.ends.map((spot) => moment.flat(spot))], item.style, item.style === "guide" ? 0.35 : 0.9);
    view.context.setLineDash([]);
  },
  joint: (view, moment, item) => view.disc(moment.flat(item.at), item.r * view.size, "paper", "link"),
  particle: (view, moment, item) =>
    view.disc(moment.flat(item.at), item.r * (item.real ? 1 : view.size), "mass", "edge"),
  slider(view, moment, item) {
    const across = [-item.along[1], item.along[0]];
    const [a, b] = item.half;
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
    for (const a of [-1, 1])
      for (const b of [-1, 1])
        for (const d of [-1, 1]) {
          corners.push(off(off(at, axes[0], a * half[0], axes[1], b * half[1]), axes[2], d * half[2]));
        }
    view.shape(hull(corners), "body", "edge", 0.5);
  },
  surface(view, moment, item) {
    const [at, axes] = [moment.flat(item.at), item.frame ? flatAxes(view, moment, item) : null];
    const corners = item.outline.map((place) => {
      const x = place.map((value) => value / view.drawing.unit);
      return axes ? off(off(at, axes[0], x[0], axes[1], x[1]), axes[2], x[2]) : moment.flatVector(place);
    });
    view.shape(hull(corners), item.color || "body", "edge", 0.4);
  },
  spring(view, moment, item) {
    if (item.hinge !== undefined) {
      view.lines(spiral(moment.flat(item.hinge), item.reach * view.size), "spring", 0.5);
      return;
    }
    const { a, b, wall } = moment.ends(item);
    if (wall) wallAt(view, a, b);
    view.lines(zigzag(a, b, view.size), "spring", 0.55);
  },
  damper(view, moment, item) {
    if (item.hinge !== undefined) {
      const line = arc(moment.flat(item.hinge), 0.8 * item.reach * view.size, 0, 6.2832)[0];
      view.lines([line], "damper", 0.5);
      return;
    }
    const { a, b, wall } = moment.ends(item);
    if (wall) wallAt(view, a, b);
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

/** The wall that a spring or damper ends at. */
function wallAt(view, a, b) {
  const { across } = axesOf(a, b);
  const reach = 3.2 * view.size;
  view.lines(hatched(off(b, across, -reach), off(b, across, reach), view.size), "ground", 0.35);
}

/** Draws a pulley with everything that hangs on it; returns its centre and radius. */
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

/** Both ends of the ground under a body that has moved between the stations of `item.span`. */
function railEnds(item) {
  const [least, most] = item.span ?? [0, 0];
  return [least - item.reach, most + item.reach].map((x) => off(item.middle, item.along, x));
}

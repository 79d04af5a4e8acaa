/** The shapes that engineers draw, as polylines of points [x, y] in units of the picture. */

const TURNS = 6;

function axesOf(a, b) {
  const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
  const along = length > 0 ? [(b[0] - a[0]) / length, (b[1] - a[1]) / length] : [1, 0];
  return { along, across: [-along[1], along[0]], length };
}

function off(point, along, x, across = [0, 0], y = 0) {
  return [point[0] + x * along[0] + y * across[0], point[1] + x * along[1] + y * across[1]];
}

/** A spring from a to b, straight at its ends. */
function zigzag(a, b, size = 1) {
  const { along, across, length } = axesOf(a, b);
  const lead = Math.min(0.2 * length, 4 * size);
  const half = Math.min(2.2 * size, 0.3 * length);
  const line = [a, off(a, along, lead)];
  for (let k = 1; k < 2 * TURNS; k += 1) {
    const x = lead + ((length - 2 * lead) * k) / (2 * TURNS);
    line.push(off(a, along, x, across, k % 2 === 1 ? half : -half));
  }
  return [[...line, off(a, along, length - lead), b]];
}

/** A damper from a to b: a cylinder that is open at one end, a rod with its piston. */
function pot(a, b, size = 1) {
  const { along, across, length } = axesOf(a, b);
  const middle = off(a, along, length / 2);
  const half = Math.min(3 * size, 0.2 * length);
  const width = 1.8 * size;
  const corner = (x, y) => off(middle, along, x, across, y);
  return [
    [a, corner(-half, 0)],
    [corner(half, width), corner(-half, width), corner(-half, -width), corner(half, -width)],
    [corner(0, 0.8 * width), corner(0, -0.8 * width)],
    [middle, b],
  ];
}

/** A torsion spring about a centre, turned by an angle. */
function spiral(center, reach) {
  const line = [];
  for (let k = 0; k <= 60; k += 1) {
    const angle = (4.5 * Math.PI * k) / 60;
    const radius = reach * (0.3 + (0.7 * k) / 60);
    line.push([center[0] + radius * Math.cos(angle), center[1] + radius * Math.sin(angle)]);
  }
  return [line];
}

/** A wall from a to b, hatched on its right side. */
function hatched(a, b, size = 1) {
  const { along, across, length } = axesOf(a, b);
  const count = Math.max(3, Math.round(length / (1.8 * size)));
  const lines = [[a, b]];
  for (let k = 0; k < count; k += 1) {
    const foot = off(a, along, (0.08 + (0.92 * k) / (count - 1)) * length);
    lines.push([foot, off(foot, along, -1.2 * size, across, -1.7 * size)]);
  }
  return lines;
}

/** A fixed hinge: a triangle on hatched ground. */
function support(pivot, size = 1) {
  const [left, right] = [-2.6, 2.6].map((x) => [pivot[0] + x * size, pivot[1] - 4.2 * size]);
  const ends = [left[0] - 1.2 * size, right[0] + 1.2 * size].map((x) => [x, left[1]]);
  return [[pivot, left, right, pivot], ...hatched(ends[0], ends[1], size)];
}

function cross(center, size = 1) {
  const [x, y] = center;
  const reach = 1.2 * size;
  return [
    [
      [x - reach, y],
      [x + reach, y],
    ],
    [
      [x, y - reach],
      [x, y + reach],
    ],
  ];
}

/** An arrow from a to b: its shaft and its head. */
function arrow(a, b, head = 2) {
  const { along, across } = axesOf(a, b);
  const foot = off(b, along, -head);
  return [
    [a, foot],
    [b, off(foot, along, 0, across, 0.4 * head), off(foot, along, 0, across, -0.4 * head), b],
  ];
}

/** An arrow along a circle from one angle to another. */
function arc(center, radius, first, last) {
  const line = [];
  for (let k = 0; k <= 24; k += 1) {
    const angle = first + ((last - first) * k) / 24;
    line.push([center[0] + radius * Math.cos(angle), center[1] + radius * Math.sin(angle)]);
  }
  const { along } = axesOf(line[23], line[24]);
  return [line, arrow(off(line[24], along, -0.01), off(line[24], along, 1.8), 1.8)[1]];
}

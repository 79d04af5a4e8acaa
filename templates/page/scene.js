/** The common part of both views: the places of the drawing's parts in the picture, at the spots of one moment. */

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const cross3 = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unitVector = (a) => {
  const length = Math.hypot(...a);
  return length > 0 ? a.map((x) => x / length) : [1, 0, 0];
};

/** The spots of one moment; `world` in m, `flat` in units of the picture. */
class Moment {
  constructor(drawing, spots) {
    this.drawing = drawing;
    this.spots = spots;
  }

  world(spot) {
    return [this.spots[3 * spot], this.spots[3 * spot + 1], this.spots[3 * spot + 2]];
  }

  /** A vector of the world in the picture, as far as it lies in the plane. */
  flatVector(vector) {
    const { right, up, unit } = this.drawing;
    return [dot(vector, right) / unit, dot(vector, up) / unit];
  }

  flat(spot) {
    const [x, y] = this.flatVector(this.world(spot));
    const shift = this.drawing.shift[spot];
    return shift ? [x + shift[0], y + shift[1]] : [x, y];
  }

  /** The three axes of a body, as rows. */
  axes(item) {
    if (item.frame) {
      const frame = item.frame.map((spot) => this.world(spot));
      return item.axes.map((row) =>
        [0, 1, 2].map((k) => row[0] * frame[0][k] + row[1] * frame[1][k] + row[2] * frame[2][k]),
      );
    }
    if (item.ray) {
      const along = unitVector(minus(this.world(item.ray[1]), this.world(item.ray[0])));
      const across = unitVector(cross3([0, 0, 1], along));
      return [along, across, cross3(along, across)];
    }
    const spoke = this.world(item.turn);
    if (item.k === "rod") return [spoke, cross3([0, 0, 1], spoke), [0, 0, 1]];
    return [[0, 0, 1], spoke, cross3([0, 0, 1], spoke)];
  }

  /** Half edges or radii, m. */
  size(item) {
    return item.extent === undefined ? item.size : [this.spots[3 * item.extent] || 0, 0, 0];
  }

  /** Both ends of a spring or damper in the picture; `wall` says whether the second end is at a wall. */
  ends(item) {
    if (item.along) return this.toWall(item);
    const [a, b] = item.ends.map((spot) => this.flat(spot));
    const { along, across } = axesOf(a, b);
    return {
      a: off(a, along, item.half[0], across, item.aside),
      b: off(b, along, -item.half[1], across, item.aside),
      wall: false,
    };
  }

  toWall(item) {
    const along = this.flatVector(item.along.map((x) => x * this.drawing.unit));
    const { across } = axesOf([0, 0], along);
    const held = this.flatVector(item.wall);
    let start;
    if (item.link) {
      const [a, b] = item.link.map((spot) => this.flat(spot));
      start = [a[0] + item.share * (b[0] - a[0]), a[1] + item.share * (b[1] - a[1])];
    } else {
      start = off(this.flat(item.ends[0]), along, item.half[0]);
      const shift = this.drawing.shift[item.ends[0]];
      if (shift) held.forEach((_, k) => (held[k] += shift[k]));
    }
    const reach = (held[0] - start[0]) * along[0] + (held[1] - start[1]) * along[1];
    return {
      a: off(start, across, item.aside),
      b: off(start, along, reach, across, item.aside),
      wall: true,
    };
  }
}

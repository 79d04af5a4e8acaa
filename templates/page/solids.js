/** The parts of a drawing as solids of three.js, which are moved from frame to frame. */

const WINDINGS = 9;

/** {group, move(moment)} of all parts of a drawing, with the given opacity. */
function makeParts(three, drawing, colors, opacity) {
  const maker = new Maker(three, drawing, colors, opacity);
  const moves = drawing.items.filter((item) => MAKERS[item.k]).map((item) => MAKERS[item.k](maker, item));
  return { group: maker.group, move: (moment) => moves.forEach((move) => move(moment)) };
}

class Maker {
  constructor(three, drawing, colors, opacity) {
    Object.assign(this, { three, drawing, colors, opacity, group: new three.Group(), materials: new Map(), read: 0 });
  }

  /** The material of a style; `flat` shows each triangle as a plane. */
  material(style, flat = false) {
    const key = `${style} ${flat}`;
    if (!this.materials.has(key)) {
      const options = {
        flatShading: flat,
        color: this.colors(style),
        transparent: this.opacity < 1,
        opacity: this.opacity,
        shininess: 40,
      };
      this.materials.set(key, new this.three.MeshPhongMaterial(options));
    }
    return this.materials.get(key);
  }

  mesh(geometry, style, flat = false) {
    const mesh = new this.three.Mesh(geometry, this.material(style, flat));
    mesh.frustumCulled = false;
    this.group.add(mesh);
    return mesh;
  }

  /** The triangles of a surface, in m; surfaces stand in the drawing's bytes in the order of its items. */
  geometry({ vertices, triangles, low, step }) {
    const counted = new Uint16Array(this.drawing.surfaces, this.read, 3 * vertices);
    const corners = new Uint16Array(this.drawing.surfaces, this.read + counted.byteLength, 3 * triangles);
    this.read += counted.byteLength + corners.byteLength;
    const places = Float32Array.from(counted, (count, k) => low[k % 3] + count * step[k % 3]);
    const geometry = new this.three.BufferGeometry();
    geometry.setAttribute("position", new this.three.BufferAttribute(places, 3));
    geometry.setIndex(new this.three.BufferAttribute(corners, 1));
    return geometry;
  }

  sphere(radius, style) {
    return this.mesh(new this.three.SphereGeometry(radius, 24, 16), style);
  }

  /** A cylinder along y, of length 1. */
  bar(radius, style) {
    return this.mesh(new this.three.CylinderGeometry(radius, radius, 1, 14), style);
  }

  line(count, style) {
    const geometry = new this.three.BufferGeometry();
    geometry.setAttribute("position", new this.three.BufferAttribute(new Float32Array(3 * count), 3));
    const options = { color: this.colors(style), transparent: this.opacity < 1, opacity: this.opacity };
    const line = new this.three.Line(geometry, new this.three.LineBasicMaterial(options));
    line.frustumCulled = false;
    this.group.add(line);
    return line;
  }

  place(moment, spot) {
    return moment.world(spot).map((x) => x / this.drawing.unit);
  }

  /** Lays a bar of length 1 along y between two places. */
  span(bar, a, b) {
    const along = new this.three.Vector3(...minus(b, a));
    const length = along.length();
    bar.visible = length > 1e-9;
    if (!bar.visible) return;
    bar.position.set(...a.map((x, k) => (x + b[k]) / 2));
    bar.scale.set(1, length, 1);
    bar.quaternion.setFromUnitVectors(new this.three.Vector3(0, 1, 0), along.divideScalar(length));
  }

  /** Turns an object such that its x, y, z lie along the rows of `axes`. */
  turn(object, axes) {
    const basis = new this.three.Matrix4();
    const right = cross3(axes[0], axes[1]);
    basis.makeBasis(...[axes[0], axes[1], right].map((axis) => new this.three.Vector3(...axis)));
    object.quaternion.setFromRotationMatrix(basis);
  }

  upright() {
    return this.drawing.down ? this.drawing.down.map((x) => -x) : [0, 0, 1];
  }
}

const shifted = (a, along, x) => a.map((value, k) => value + x * along[k]);

const still = () => {};

/** The function that makes each kind of part; it returns a function that moves the part. */
const MAKERS = {
  support(maker, item) {
    const cone = maker.mesh(new maker.three.ConeGeometry(2.2, 3.4, 4), "ground");
    return (moment) => {
      const at = maker.place(moment, item.at);
      const up = maker.upright();
      cone.quaternion.setFromUnitVectors(new maker.three.Vector3(0, 1, 0), new maker.three.Vector3(...up));
      cone.position.set(...shifted(at, up, -1.7));
    };
  },
  cross(maker, item) {
    const mark = maker.sphere(0.5, "axis");
    return (moment) => mark.position.set(...maker.place(moment, item.at));
  },
  link(maker, item) {
    const bar = maker.bar(item.style === "guide" ? 0.12 : 0.42, item.style);
    return (moment) => maker.span(bar, ...item.ends.map((spot) => maker.place(moment, spot)));
  },
  joint(maker, item) {
    const ball = maker.sphere(0.9 * item.r, "link");
    return (moment) => ball.position.set(...maker.place(moment, item.at));
  },
  particle(maker, item) {
    const ball = maker.sphere(item.r, "mass");
    return (moment) => ball.position.set(...maker.place(moment, item.at));
  },
  slider(maker, item) {
    const box = maker.mesh(new maker.three.BoxGeometry(4, 4, 4), "body");
    return (moment) => box.position.set(...maker.place(moment, item.at));
  },
  rod(maker, item) {
    const bar = maker.bar(1.1, "rod");
    return (moment) => {
      const at = maker.place(moment, item.at);
      const reach = moment.size(item)[0] / maker.drawing.unit;
      const [along] = moment.axes(item);
      maker.span(bar, shifted(at, along, -reach), shifted(at, along, reach));
    };
  },
  disc(maker, item) {
    const wheel = new maker.three.Group();
    const radius = Math.max(0.5, item.size[0] / maker.drawing.unit);
    const thickness = Math.max(0.6, 0.08 * radius);
    const tyre = maker.mesh(new maker.three.CylinderGeometry(radius, radius, thickness, 48), "body");
    const spokes = [0, 1].map((k) => {
      const spoke = maker.mesh(new maker.three.BoxGeometry(0.14 * radius, thickness * 1.06, 1.96 * radius), "mass");
      spoke.rotation.y = (k * Math.PI) / 2;
      return spoke;
    });
    wheel.add(tyre, ...spokes);
    maker.group.add(wheel);
    return (moment) => {
      const [normal, first] = moment.axes(item);
      wheel.position.set(...maker.place(moment, item.at));
      maker.turn(wheel, [cross3(normal, first).map((x) => -x), normal]);
    };
  },
  ball(maker, item) {
    const radius = Math.max(1.4, item.size[0] / maker.drawing.unit);
    const ball = new maker.three.Group();
    ball.add(maker.sphere(radius, "body"));
    for (const k of [0, 1, 2]) {
      const ring = maker.mesh(new maker.three.TorusGeometry(radius, 0.025 * radius, 6, 64), "mass");
      ring.rotation.set(k === 1 ? Math.PI / 2 : 0, k === 2 ? Math.PI / 2 : 0, 0);
      ball.add(ring);
    }
    maker.group.add(ball);
    return (moment) => {
      ball.position.set(...maker.place(moment, item.at));
      maker.turn(ball, moment.axes(item));
    };
  },
  cuboid(maker, item) {
    const [a, b, c] = item.size.map((x) => Math.max(0.5, (2 * x) / maker.drawing.unit));
    const box = maker.mesh(new maker.three.BoxGeometry(a, b, c), "body");
    const edges = new maker.three.LineSegments(
      new maker.three.EdgesGeometry(box.geometry),
      new maker.three.LineBasicMaterial({ color: maker.colors("edge"), transparent: true, opacity: maker.opacity }),
    );
    box.add(edges);
    return (moment) => {
      box.position.set(...maker.place(moment, item.at));
      maker.turn(box, moment.axes(item));
    };
  },
  surface(maker, item) {
    const mesh = maker.mesh(maker.geometry(item), item.color || "body", true);
    const scale = 1 / maker.drawing.unit;
    mesh.scale.set(scale, scale, scale);
    return (moment) => {
      mesh.position.set(...maker.place(moment, item.at));
      if (item.frame) maker.turn(mesh, moment.axes(item));
    };
  },
  spring(maker, item) {
    if (item.hinge !== undefined) return still;
    const count = 16 * WINDINGS;
    const line = maker.line(count, "spring");
    return (moment) => coil(line, count, ...ends(maker, moment, item));
  },
  damper(maker, item) {
    if (item.hinge !== undefined) return still;
    const [pot, rod] = [maker.bar(1.1, "damper"), maker.bar(0.3, "damper")];
    return (moment) => {
      const [a, b] = ends(maker, moment, item);
      const middle = a.map((x, k) => (x + b[k]) / 2);
      maker.span(pot, shifted(middle, minus(b, a), -0.2), middle);
      maker.span(rod, a, b);
    };
  },
  load(maker, item) {
    const [shaft, head] = [maker.bar(0.35, "load"), maker.mesh(new maker.three.ConeGeometry(1, 2.6, 16), "load")];
    let most = 0;
    return (moment) => {
      let vector = moment.world(item.vector);
      if (item.frame) {
        const frame = item.frame.map((spot) => moment.world(spot));
        vector = [0, 1, 2].map((k) => frame.reduce((sum, axis, i) => sum + vector[i] * axis[k], 0));
      }
      const force = Math.hypot(...vector);
      shaft.visible = head.visible = force > 1e-9;
      if (!shaft.visible) return;
      most = Math.max(most, force);
      const along = unitVector(vector);
      const at = maker.place(moment, item.at);
      const end = shifted(at, along, 5 + (11 * force) / most);
      maker.span(shaft, at, end);
      head.position.set(...end);
      head.quaternion.setFromUnitVectors(new maker.three.Vector3(0, 1, 0), new maker.three.Vector3(...along));
    };
  },
};

/** Both ends of a spring or damper, in units of the picture. */
function ends(maker, moment, item) {
  if (!item.along) return item.ends.map((spot) => maker.place(moment, spot));
  const wall = item.wall.map((x) => x / maker.drawing.unit);
  if (!item.link) return [maker.place(moment, item.ends[0]), wall];
  const [a, b] = item.link.map((spot) => maker.place(moment, spot));
  return [a.map((x, k) => x + item.share * (b[k] - x)), wall];
}

/** A helix about the line from a to b. */
function coil(line, count, a, b) {
  const along = minus(b, a);
  const length = Math.hypot(...along);
  const axis = unitVector(along);
  const first = unitVector(cross3(axis, Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
  const second = cross3(axis, first);
  const radius = Math.min(1.5, 0.25 * length);
  const { position } = line.geometry.attributes;
  for (let k = 0; k < count; k += 1) {
    const share = k / (count - 1);
    const inner = Math.min(1, Math.max(0, (share - 0.12) / 0.76));
    const angle = 2 * Math.PI * WINDINGS * inner;
    const r = inner > 0 && inner < 1 ? radius : 0;
    const at = a.map((x, i) => x + share * along[i] + r * (Math.cos(angle) * first[i] + Math.sin(angle) * second[i]));
    position.setXYZ(k, ...at);
  }
  position.needsUpdate = true;
}

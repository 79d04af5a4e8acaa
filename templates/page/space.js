/** The mechanism in space, by three.js: the mouse turns the view, the wheel zooms. */

const FIELD = 32;

/** A view of `drawing` on `canvas`; `three` is the library. */
function makeSpaceView(three, canvas, drawing, colors) {
  return new SpaceView(three, canvas, drawing, colors);
}

class SpaceView {
  constructor(three, canvas, drawing, colors) {
    Object.assign(this, { three, canvas, drawing, colors });
    this.renderer = new three.WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    this.camera = new three.PerspectiveCamera(FIELD, 1, 1, 4000);
    this.up = drawing.down ? drawing.down.map((x) => -x) : [0, 0, 1];
    this.normal = cross3(drawing.right, drawing.up);
    this.turned = [0, 0];
    this.nearer = 1;
    this.forget();
    this.listen();
  }

  forget() {
    this.low = [Infinity, Infinity, Infinity];
    this.high = [-Infinity, -Infinity, -Infinity];
    this.built = false;
  }

  include(spots) {
    const moment = new Moment(this.drawing, spots);
    for (const item of this.drawing.items) {
      if (item.at === undefined && !item.ends) continue;
      const reach = item.size ? Math.max(...moment.size(item)) / this.drawing.unit : 0;
      for (const spot of item.at === undefined ? item.ends : [item.at]) this.widen(this.place(moment, spot), reach);
    }
  }

  widen(place, reach) {
    if (!place.every(Number.isFinite)) return;
    place.forEach((x, k) => {
      this.low[k] = Math.min(this.low[k], x - reach);
      this.high[k] = Math.max(this.high[k], x + reach);
    });
  }

  /** A spot in units of the picture. */
  place(moment, spot) {
    return moment.world(spot).map((x) => x / this.drawing.unit);
  }

  places(spots, wanted) {
    const moment = new Moment(this.drawing, spots);
    return wanted.map((spot) => this.place(moment, spot));
  }

  /** Sets the place of the camera and the point it looks at. */
  aim(moment) {
    let [low, high] = [this.low, this.high];
    const spread = Math.max(...high.map((x, k) => x - low[k]));
    if (spread > 400) {
      const places = this.drawing.handles.map(([, spot]) => this.place(moment, spot));
      const [least, most] = [Math.min, Math.max].map((f) => [0, 1, 2].map((k) => f(...places.map((p) => p[k]))));
      [low, high] = [least.map((x) => x - 45), most.map((x) => x + 45)];
    }
    const target = low.map((x, k) => (x + high[k]) / 2);
    const radius = Math.max(12, 0.42 * Math.hypot(...high.map((x, k) => x - low[k])) + 4);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const aspect = width / Math.max(1, height);
    const half = (FIELD * Math.PI) / 360;
    const distance = (radius / Math.sin(Math.min(half, Math.atan(Math.tan(half) * aspect)))) * this.nearer;
    const from = this.direction();
    this.camera.aspect = aspect;
    this.camera.near = distance / 50;
    this.camera.far = distance * 20;
    this.camera.up.set(...this.up);
    this.camera.position.set(...target.map((x, k) => x + distance * from[k]));
    this.camera.lookAt(...target);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
    this.renderer.setSize(width, height, false);
    this.distance = distance;
  }

  /** The unit vector from the centre of the view to the camera. */
  direction() {
    const rise = Math.asin(Math.max(-1, Math.min(1, dot(this.normal, this.up)))) + this.turned[1];
    const height = Math.max(-1.5, Math.min(1.5, rise));
    const level = unitVector(
      minus(
        this.normal,
        this.up.map((x) => x * dot(this.normal, this.up)),
      ),
    );
    const side = cross3(this.up, level);
    const [c, s] = [Math.cos(this.turned[0]), Math.sin(this.turned[0])];
    return [0, 1, 2].map((k) => Math.cos(height) * (c * level[k] + s * side[k]) + Math.sin(height) * this.up[k]);
  }

  listen() {
    let last = null;
    this.canvas.addEventListener("pointerdown", (event) => {
      if (!event.defaultPrevented) {
        last = [event.clientX, event.clientY];
        this.canvas.setPointerCapture(event.pointerId);
      }
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (!last) return;
      this.turned[0] -= (event.clientX - last[0]) / 160;
      this.turned[1] += (event.clientY - last[1]) / 160;
      last = [event.clientX, event.clientY];
      this.moved?.();
    });
    for (const end of ["pointerup", "pointercancel"]) this.canvas.addEventListener(end, () => (last = null));
    this.canvas.addEventListener(
      "wheel",
      (event) => {
        this.nearer = Math.max(0.2, Math.min(4, this.nearer * Math.exp(event.deltaY / 900)));
        event.preventDefault();
        this.moved?.();
      },
      { passive: false },
    );
  }

  /** Pixels of the page of a place. */
  toPixels(place) {
    const at = new this.three.Vector3(...place).project(this.camera);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    return [((at.x + 1) * width) / 2, ((1 - at.y) * height) / 2];
  }

  handleAt(x, y, spots, reach = 26) {
    const moment = new Moment(this.drawing, spots);
    const distances = this.drawing.handles.map(([, spot]) => {
      const [a, b] = this.toPixels(this.place(moment, spot));
      return Math.hypot(a - x, b - y);
    });
    const nearest = distances.indexOf(Math.min(...distances));
    return distances[nearest] <= reach ? this.drawing.handles[nearest] : null;
  }

  /** A handle is dragged in the plane of the screen. */
  grabbed(spot, spots) {
    const axes = [new this.three.Vector3(), new this.three.Vector3(), new this.three.Vector3()];
    this.camera.matrixWorld.extractBasis(...axes);
    const place = this.place(new Moment(this.drawing, spots), spot);
    const [x, y] = this.toPixels(place);
    const depth = new this.three.Vector3(...place).sub(this.camera.position).dot(axes[2]) * -1;
    const pixel = (2 * depth * Math.tan((FIELD * Math.PI) / 360)) / this.canvas.clientHeight;
    const [right, up] = axes.map((axis) => axis.toArray());
    this.plane = { right, up, x, y, pixel, at: [dot(place, right), dot(place, up)] };
  }

  measure(spot) {
    const { right, up } = this.plane;
    return (spots) => {
      const place = this.place(new Moment(this.drawing, spots), spot);
      return [dot(place, right), dot(place, up)];
    };
  }

  target(x, y) {
    const { at, pixel } = this.plane;
    return [at[0] + (x - this.plane.x) * pixel, at[1] - (y - this.plane.y) * pixel];
  }

  build() {
    const { three } = this;
    this.scene = new three.Scene();
    this.scene.add(new three.HemisphereLight(0xffffff, 0x8899aa, 2.1));
    const sun = new three.DirectionalLight(0xffffff, 1.6);
    this.scene.add(sun);
    this.sun = sun;
    this.parts = makeParts(three, this.drawing, this.colors, 1);
    this.scene.add(this.parts.group);
    this.ghost = makeParts(three, this.drawing, this.colors, 0.25);
    this.ghost.group.visible = false;
    this.scene.add(this.ghost.group);
    this.trails = this.drawing.handles.slice(0, 8).map(() => {
      const material = new three.LineBasicMaterial({ color: this.colors("trail"), transparent: true, opacity: 0.5 });
      const line = new three.Line(new three.BufferGeometry(), material);
      line.geometry.setAttribute("position", new three.BufferAttribute(new Float32Array(3 * 512), 3));
      line.frustumCulled = false;
      this.scene.add(line);
      return line;
    });
    this.floor = null;
    this.built = true;
  }

  /** A grid below everything, normal to gravity. */
  lay() {
    if (this.floor) {
      this.scene.remove(this.floor);
      this.floor.geometry.dispose();
    }
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) =>
      [0, 1, 2].map((i) => (k & (1 << i) ? this.high[i] : this.low[i])),
    );
    const lowest = Math.min(...corners.map((corner) => dot(corner, this.up)));
    const middle = this.low.map((x, k) => (x + this.high[k]) / 2);
    const size = Math.min(600, 1.25 * Math.max(...this.high.map((x, k) => x - this.low[k])));
    const color = this.colors("grid");
    this.floor = new this.three.GridHelper(size, 12, color, color);
    this.floor.quaternion.setFromUnitVectors(new this.three.Vector3(0, 1, 0), new this.three.Vector3(...this.up));
    const drop = lowest - 2 - dot(middle, this.up);
    this.floor.position.set(...middle.map((x, k) => x + drop * this.up[k]));
    this.scene.add(this.floor);
    this.laid = String([...this.low, ...this.high]);
  }

  draw(shown) {
    if (!this.built) this.build();
    const moment = new Moment(this.drawing, shown.spots);
    this.aim(moment);
    if (this.laid !== String([...this.low, ...this.high]) || !this.floor) this.lay();
    this.parts.move(moment);
    this.ghost.group.visible = shown.grey !== null;
    if (shown.grey) this.ghost.move(new Moment(this.drawing, shown.grey));
    shown.trails.forEach((line, k) => this.trace(this.trails[k], line));
    for (let k = shown.trails.length; k < this.trails.length; k += 1) this.trails[k].geometry.setDrawRange(0, 0);
    this.sun.position.copy(this.camera.position).addScaledVector(this.camera.up, 0.6 * this.distance);
    this.renderer.render(this.scene, this.camera);
  }

  trace(line, places) {
    const { position } = line.geometry.attributes;
    const shown = places.slice(-512);
    shown.forEach((place, k) => position.setXYZ(k, ...place));
    position.needsUpdate = true;
    line.geometry.setDrawRange(0, shown.length);
  }
}

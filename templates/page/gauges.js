/** Coordinates as gauges (dials and scales), for a mechanism without anything to draw. */

/** Draws a gauge for each of the variables `coordinates`. */
class GaugesView {
  constructor(canvas, coordinates, colors) {
    Object.assign(this, { canvas, coordinates, colors });
    this.context = canvas.getContext("2d");
    this.forget();
  }

  forget() {
    this.ranges = this.coordinates.map(() => [Infinity, -Infinity]);
  }

  /** Makes room for the values of the coordinates in this point of a run. */
  includePoint(point) {
    this.ranges.forEach((range, i) => range.splice(0, 2, Math.min(range[0], point[i]), Math.max(range[1], point[i])));
  }

  include() {}

  handleAt() {
    return null;
  }

  /** `shown.point` and `shown.greyPoint` hold the coordinates. */
  draw(shown) {
    const ratio = window.devicePixelRatio || 1;
    const { canvas, context: c } = this;
    Object.assign(canvas, { width: canvas.clientWidth * ratio, height: canvas.clientHeight * ratio });
    const columns = Math.min(this.coordinates.length, 4);
    const rows = Math.ceil(this.coordinates.length / columns);
    const [width, height] = [canvas.width / columns, canvas.height / rows];
    this.coordinates.forEach((variable, i) => {
      const center = [(i % columns) * width + width / 2, Math.floor(i / columns) * height + height / 2];
      const size = Math.min(width, height) * 0.36;
      const gauge = variable.unit === "rad" || variable.unit === "deg" ? this.dial : this.scale;
      if (shown.greyPoint) {
        c.globalAlpha = 0.35;
        gauge.call(this, center, size, shown.greyPoint[i], this.ranges[i]);
        c.globalAlpha = 1;
      }
      gauge.call(this, center, size, shown.point[i], this.ranges[i]);
      c.fillStyle = this.colors("text");
      c.textAlign = "center";
      c.font = `${13 * ratio}px system-ui, sans-serif`;
      c.fillText(variable.name, center[0], center[1] + size + 22 * ratio);
    });
  }

  dial([x, y], size, angle) {
    const c = this.context;
    c.lineCap = "round";
    c.strokeStyle = this.colors("ground");
    c.lineWidth = size * 0.03;
    c.beginPath();
    c.arc(x, y, size, 0, 2 * Math.PI);
    c.stroke();
    c.strokeStyle = this.colors("mass");
    c.lineWidth = size * 0.09;
    c.beginPath();
    c.moveTo(x, y);
    c.lineTo(x + size * 0.82 * Math.cos(angle), y - size * 0.82 * Math.sin(angle));
    c.stroke();
  }

  scale([x, y], size, value, [least, most]) {
    const c = this.context;
    const share = most > least ? (value - least) / (most - least) : 0.5;
    c.strokeStyle = this.colors("ground");
    c.lineWidth = size * 0.05;
    c.lineCap = "round";
    c.beginPath();
    c.moveTo(x, y + size);
    c.lineTo(x, y - size);
    c.stroke();
    c.fillStyle = this.colors("mass");
    c.beginPath();
    c.arc(x, y + size - 2 * size * share, size * 0.13, 0, 2 * Math.PI);
    c.fill();
  }
}

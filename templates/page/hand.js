/** Dragging a body to the place where the mechanism starts. */

const MOUSE = 26;
const FINGER = 44;

/** The actions of the pointer on the canvas of a page; `q` are the coordinates during a drag, else null. */
class Hand {
  constructor(page, canvas) {
    Object.assign(this, { page, canvas, spot: null, q: null });
    canvas.addEventListener("pointerdown", (event) => this.grab(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.pull(event));
    canvas.addEventListener("pointerup", () => this.let());
    canvas.addEventListener("pointercancel", () => this.drop());
  }

  place(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  /** The spots that are shown. */
  shown() {
    const { run, player } = this.page;
    return run.pose(Math.min(player.time, run.end));
  }

  handle(event) {
    const { drawing, view, run } = this.page;
    if (!drawing || run.points.length === 0) return null;
    return view.handleAt(...this.place(event), this.shown(), event.pointerType === "touch" ? FINGER : MOUSE);
  }

  grab(event) {
    const handle = event.button === 0 ? this.handle(event) : null;
    if (!handle) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.spot = handle[1];
    this.played = this.page.player.playing;
    this.page.player.pause();
    this.page.view.grabbed?.(this.spot, this.shown());
    event.preventDefault();
  }

  pull(event) {
    const { page } = this;
    if (this.spot === null) {
      if (event.buttons === 0) this.canvas.classList.toggle("over", this.handle(event) !== null);
      return;
    }
    this.shown();
    if (this.q) page.mechanism.point.set(this.q);
    const nominals = page.coordinates.map((variable) => variable.nominal || 1);
    const measure = page.view.measure(this.spot);
    const target = page.view.target(...this.place(event));
    this.q = reach(page.mechanism, target, measure, 3 * page.drawing.count, nominals);
    page.changed();
  }

  /** Starts the run at the coordinates to which the body was dragged. */
  let() {
    const { q } = this;
    const { page } = this;
    const moved = this.spot !== null && q !== null;
    this.drop();
    if (!moved) return;
    const inside = (variable, x) => Math.min(variable.max ?? x, Math.max(variable.min ?? x, x));
    const settings = new Map(page.run.settings);
    page.coordinates.forEach((variable, i) => settings.set(variable.index, inside(variable, q[i])));
    page.startAt(settings);
  }

  drop() {
    if (this.spot !== null && this.played) this.page.player.play();
    this.spot = null;
    this.q = null;
  }
}

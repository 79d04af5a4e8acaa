/** The controls of the time: buttons, the time bar, keys. */

const byId = (id) => document.getElementById(id);
const SPEEDS = [0.05, 0.1, 0.25, 0.5, 1, 2, 4, 10];

/** The time of a page, s, and whether it plays. */
class Player {
  constructor(page, speed, playing) {
    Object.assign(this, { page, speed, playing, time: 0, before: null, repeats: true });
    this.bar = byId("time");
    this.bar.max = page.experiment.stop;
    this.bar.step = "any";
    this.bar.addEventListener("input", () => this.seek(Number(this.bar.value)));
    byId("play").addEventListener("click", () => this.toggle());
    byId("first").addEventListener("click", () => this.seek(0));
    byId("back").addEventListener("click", () => this.step(-1));
    byId("forward").addEventListener("click", () => this.step(1));
    byId("repeat").addEventListener("click", () => this.repeat());
    byId("stop").addEventListener("change", (event) => page.setStop(Number(event.target.value)));
    this.offerSpeeds();
    document.addEventListener("keydown", (event) => this.key(event));
  }

  offerSpeeds() {
    const list = byId("speed");
    const offered = new Set([...SPEEDS.map((x) => Number((x * this.page.model.speed).toPrecision(3))), this.speed]);
    const words = (x) => (x === 1 ? "real time" : `${x} ×`);
    list.append(...[...offered].sort((a, b) => a - b).map((x) => new Option(words(x), x)));
    list.value = this.speed;
    list.addEventListener("change", () => {
      this.speed = Number(list.value);
      this.page.changed();
    });
  }

  play() {
    if (this.time >= this.page.experiment.stop) this.time = 0;
    this.playing = true;
    this.before = null;
    this.page.changed();
  }

  pause() {
    this.playing = false;
    this.page.changed();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  repeat() {
    this.repeats = !this.repeats;
    byId("repeat").setAttribute("aria-pressed", String(this.repeats));
  }

  /** Goes by so many communication steps. */
  step(count) {
    const step = this.page.run.timeOf(1);
    this.seek((Math.round(this.time / step) + count) * step);
  }

  /** Goes to a time, and stays there unless the player plays. */
  seek(time) {
    this.time = Math.min(Math.max(0, time), this.page.experiment.stop);
    if (this.time > this.page.run.end) this.page.run.compute(200, this.time);
    if (document.activeElement !== this.bar) this.before = null;
    this.page.changed();
  }

  /** A frame at `now`, ms. */
  advance(now) {
    if (!this.playing) return;
    const passed = this.before === null ? 0 : Math.min(0.1, (now - this.before) / 1000);
    this.before = now;
    const { run } = this.page;
    this.time = Math.min(this.time + passed * this.speed, run.done ? run.end : Math.max(this.time, run.end));
    if (run.done && this.time >= run.end) {
      if (this.repeats) this.time = 0;
      else this.pause();
    }
  }

  key(event) {
    const field = event.target.closest?.("input, select, textarea, summary, button, a");
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (field && (field.type !== "range" || field.dataset.name) && (event.key !== " " || field.tagName !== "BUTTON"))
      return;
    if (field?.tagName === "BUTTON") return;
    const count = event.shiftKey ? 10 : 1;
    const keys = {
      " ": () => this.toggle(),
      ArrowLeft: () => this.step(-count),
      ArrowRight: () => this.step(count),
      Home: () => this.seek(0),
      End: () => this.seek(this.page.experiment.stop),
      "+": () => this.faster(1),
      "-": () => this.faster(-1),
      g: () => this.page.keep(),
      r: () => this.page.reset(),
    };
    if (!keys[event.key]) return;
    if (event.key.startsWith("Arrow")) this.pause();
    keys[event.key]();
    event.preventDefault();
  }

  faster(by) {
    const list = byId("speed");
    list.selectedIndex = Math.min(Math.max(0, list.selectedIndex + by), list.options.length - 1);
    this.speed = Number(list.value);
    this.page.changed();
  }

  show() {
    const { stop } = this.page.experiment;
    const digits = Math.max(0, Math.min(6, 3 - Math.ceil(Math.log10(stop))));
    const text = `${this.time.toFixed(digits)} s`;
    if (byId("clock").textContent !== text) byId("clock").textContent = text;
    if (Number(this.bar.max) !== stop) this.bar.max = stop;
    this.bar.value = this.time;
    this.bar.setAttribute("aria-valuetext", text);
    this.bar.style.setProperty("--done", `${(100 * this.page.run.end) / stop}%`);
    if (document.activeElement !== byId("stop")) byId("stop").value = Number(stop.toPrecision(6));
    const play = byId("play");
    if (play.dataset.playing !== String(this.playing)) {
      play.dataset.playing = String(this.playing);
      play.setAttribute("aria-label", this.playing ? "Pause" : "Play");
      play.textContent = this.playing ? "❚❚" : "►";
    }
  }
}

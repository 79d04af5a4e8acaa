/** The live page: a run of the mechanism, its views and its controls. */

const BUDGET = 7;

const calm = window.matchMedia("(prefers-reduced-motion: reduce)");

/** Bytes of a script element, which holds them deflated in base 64. */
async function unpacked(id) {
  const packed = Uint8Array.from(atob(byId(id).textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

class Page {
  constructor(model, mechanism, three) {
    Object.assign(this, { model, mechanism, colors: colorOf, grey: null, offset: null });
    this.variables = model.variables;
    this.coordinates = model.coordinates.map((name) => this.variables.find((v) => v.name === name));
    this.watched = this.variables.filter((variable) => variable.discrete && variable.watched);
    this.drawing = model.drawing;
    this.view = makeView(this, three);
    this.trails = new Trails(this);
    this.given = readAddress(this.hash(), this.variables);
    this.begin();
  }

  hash() {
    return window.location.hash;
  }

  begin() {
    const { settings, grey, words } = this.given;
    const stop = Number(words.stop) > 0 ? Number(words.stop) : this.model.experiment.stop;
    this.experiment = { ...this.model.experiment, stop };
    if (grey) {
      this.grey = new Run(this.mechanism, this.experiment, grey, this.watched);
      this.grey.compute(2000, Infinity);
    }
    this.start(settings);
    this.run.compute(300);
    enlarge(this.drawing, this.run);
    this.player = new Player(this, Number(words.speed) || this.model.speed, !calm.matches && words.paused !== "1");
    this.panel = new Panel(this, (time) => this.player.seek(time));
    this.panel.choose((words.plot ?? this.model.plot.join(",")).split(","));
    this.panel.choosePhase(...(words.phase ?? this.model.phase.join(",")).split(","));
    const settable = (kind) => this.variables.filter((variable) => variable.kind === kind);
    const groups = [
      ["Parameters", settable("parameter"), true],
      ["Inputs", settable("input"), settable("parameter").length < 5],
      ["Start values", [...settable("coordinate"), ...settable("velocity")], false],
    ];
    this.settings = new Settings(
      byId("settings"),
      groups,
      (v) => this.swing(v),
      (v, x) => this.change(v, x),
    );
    this.showSettings();
    if (words.t) this.player.seek(Math.min(Number(words.t) || 0, stop));
    this.listen();
  }

  /** A run from the start with these settings; the time is 0. */
  start(settings) {
    this.run = new Run(this.mechanism, this.experiment, settings, this.watched);
    this.seen = 0;
    this.default = [...settings].every(([index, value]) => this.byIndex(index).start === value);
    this.view.forget();
    this.changed();
  }

  /** Begins such a run and plays it, unless it cannot start with these settings. */
  startAt(settings) {
    const before = this.run.settings;
    this.start(settings);
    this.trouble = "";
    if (this.run.error) {
      this.trouble = `It cannot start there: ${this.run.error}`;
      this.start(before);
    }
    this.player.time = 0;
    this.showSettings();
    if (!calm.matches) this.player.play();
  }

  byIndex(index) {
    return this.variables.find((variable) => variable.index === index);
  }

  /** A typical size of a variable that starts at 0. */
  swing(variable) {
    if (variable.nominal) return variable.nominal / variable.factor;
    const energy = this.variables.find((v) => v.name === "kinetic_energy");
    this.run.compute(40);
    const most = energy ? Math.max(1e-9, ...this.run.column(energy)) : 1;
    return Math.abs(variable.start / variable.factor) || most;
  }

  changed() {
    this.stale = true;
    clearTimeout(this.saving);
    this.saving = setTimeout(() => this.save(), 300);
  }

  save() {
    const { run, grey, player, panel } = this;
    const words = { plot: panel.lines.join(","), phase: panel.pair.map((v) => v.name).join(",") };
    if (words.plot === this.model.plot.join(",")) words.plot = "";
    if (words.phase === this.model.phase.join(",")) words.phase = "";
    words.speed = player.speed === this.model.speed ? "" : player.speed;
    words.stop = this.experiment.stop === this.model.experiment.stop ? "" : this.experiment.stop;
    words.paused = player.playing ? "" : "1";
    words.t = player.playing || player.time === 0 ? "" : Number(player.time.toPrecision(6));
    const text = addressOf({ settings: run.settings, grey: grey?.settings, words }, this.variables);
    try {
      window.history.replaceState(null, "", text ? `#${text}` : "#");
    } catch {
      return; // the page is in a frame that has no address
    }
  }

  /** Sets a variable to a value (SI); a variable that is fixed in a run begins a new run. */
  change(variable, value) {
    const fixed = variable.fixed || this.player.time === 0;
    const settings = new Map(this.run.settings).set(variable.index, value);
    this.settings.set(variable, value);
    this.trouble = "";
    if (fixed) {
      this.start(settings);
      this.player.time = 0;
    } else {
      this.run.compute(1000, this.player.time);
      this.run.change(variable, value, this.player.time);
      this.run.settings.set(variable.index, value);
      this.default = false;
    }
    this.changed();
  }

  showSettings() {
    for (const variable of this.variables) {
      this.settings.set(variable, this.run.settings.get(variable.index) ?? variable.start);
    }
  }

  /** Sets all variables to the values of the model. */
  reset() {
    this.grey = null;
    this.start(new Map());
    this.player.time = 0;
    this.panel.rebuild();
    this.showSettings();
  }

  /** Keeps the present run in grey and begins another one. */
  keep() {
    this.run.compute(3000);
    this.grey = this.grey ? null : this.run;
    if (this.grey) this.start(this.run.settings);
    this.player.time = this.grey ? 0 : this.player.time;
    byId("keep").setAttribute("aria-pressed", String(this.grey !== null));
    this.panel.rebuild();
  }

  setStop(stop) {
    if (!(stop > 0)) return;
    const steps = stop / this.model.experiment.step;
    const step = steps > 20000 ? stop / 20000 : this.model.experiment.step;
    this.experiment = { ...this.experiment, stop, step };
    this.grey = null;
    this.start(this.run.settings);
    this.player.time = 0;
    this.panel.rebuild();
  }

  listen() {
    const canvas = byId("view");
    this.view.moved = () => this.changed();
    this.hand = new Hand(this, canvas);
    onSchemeChange(() => {
      this.view.forget();
      this.seen = 0;
      this.panel.choose(this.panel.lines);
    });
    new ResizeObserver(() => this.changed()).observe(canvas);
    byId("reset").addEventListener("click", () => this.reset());
    byId("keep").addEventListener("click", () => this.keep());
  }

  /** One frame: computes ahead, then shows the state at the player's time. */
  frame(now) {
    const begin = performance.now();
    if (!this.run.done) this.run.compute(this.seen === 0 ? 4 * BUDGET : BUDGET);
    this.player.advance(now);
    if (this.stale || this.player.playing || !this.run.done) this.show();
    this.times ??= [];
    this.times.push(performance.now() - begin);
    if (this.times.length > 600) this.times.shift();
    window.requestAnimationFrame((time) => this.frame(time));
  }

  show() {
    this.stale = !this.run.done;
    this.includeNew();
    const time = Math.min(this.player.time, this.run.end);
    const shown = { trails: [], grey: null, greyPoint: null };
    if (this.run.points.length === 0) {
      byId("message").textContent = this.run.error;
      return;
    }
    if (this.grey) {
      shown.grey = this.grey.pose(Math.min(time, this.grey.end)).slice();
      shown.greyPoint = this.mechanism.point.slice(0, this.coordinates.length);
    }
    if (this.drawing) shown.trails = this.trails.until(this.run, time);
    shown.spots = this.run.pose(time);
    if (this.hand.q) {
      this.mechanism.point.set(this.hand.q);
      shown.spots = this.mechanism.draw(0);
      shown.trails = [];
    }
    shown.point = this.mechanism.point;
    this.view.draw(shown);
    this.panel.update(time);
    this.player.show();
    this.tell(time);
  }

  /** Extends the view to the records since the last call, and to the grey run. */
  includeNew() {
    const { run, grey } = this;
    if (this.seen === 0 && grey) this.include(grey, 0);
    this.seen = this.include(run, this.seen);
  }

  /** Extends the view to the records of a run from `first` on; returns the index of the next record. */
  include(run, first) {
    const stride = Math.ceil(run.count / 600);
    let index = first;
    for (; index < run.points.length; index += stride) {
      this.mechanism.point.set(run.points[index]);
      if (this.drawing) this.view.include(this.mechanism.draw(run.timeOf(index)));
      else this.view.includePoint(run.points[index]);
    }
    return index;
  }

  /** Modes, messages and the badge. */
  tell(time) {
    const { run } = this;
    const modes = this.watched.filter((variable) => variable.items);
    const words = modes.map((v) => `${v.short}: ${(v.items[run.valueAt(v, time)] ?? "").replace("_", " ")}`);
    const text = words.join("   ");
    if (byId("modes").textContent !== text) byId("modes").textContent = text;
    const message = run.error ? `Ends at ${run.end.toPrecision(4)} s: ${run.error}` : (this.trouble ?? "");
    if (byId("message").textContent !== message) byId("message").textContent = message;
    if (this.model.reference && !this.judged && this.default && run.done && !run.error) {
      const {
        passed,
        text: said,
        title,
      } = verdict(compare(run, this.model.reference, this.variables), this.model.reference);
      Object.assign(byId("badge"), { textContent: said, title, className: passed ? "good" : "bad" });
      this.judged = true;
    }
  }
}

async function main() {
  const model = JSON.parse(byId("model").textContent);
  const mechanism = await loadMechanism(await unpacked("module"));
  if (byId("surfaces")) model.drawing.surfaces = (await unpacked("surfaces")).buffer;
  let three = null;
  if (byId("three")) {
    const address = URL.createObjectURL(new Blob([await unpacked("three")], { type: "text/javascript" }));
    three = await import(address);
    URL.revokeObjectURL(address);
  }
  const page = new Page(model, mechanism, three);
  window.lag2fmu = page;
  window.requestAnimationFrame((time) => page.frame(time));
}

main().catch((error) => {
  byId("message").textContent = `This page cannot run here: ${error.message}`;
  console.error(error);
});

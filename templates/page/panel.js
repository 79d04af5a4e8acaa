/** The plots below the drawing: variables over the time, energies, balance, a phase portrait. */

const MOST_LINES = 6;
const ENERGIES = ["kinetic_energy", "potential_energy", "total_energy"];

/** The plots of a page; `seek(time)` moves it. */
class Panel {
  constructor(page, seek) {
    Object.assign(this, { page, seek, plots: [] });
    this.host = document.getElementById("plots");
    this.phase = new PhasePlot(document.getElementById("phase"), page.colors);
    this.choices();
    this.version = null;
    new ResizeObserver(() => this.resize()).observe(this.host);
  }

  get variables() {
    return this.page.variables;
  }

  named(name) {
    return this.variables.find((variable) => variable.name === name);
  }

  /** Fills the lists from which variables are chosen. */
  choices() {
    const options = () => this.variables.map((variable) => new Option(variable.name, variable.name));
    this.add = document.getElementById("add");
    this.add.append(...options());
    this.add.addEventListener("change", () => {
      if (this.add.value) this.choose([...this.lines, this.add.value].slice(-MOST_LINES));
      this.add.value = "";
    });
    this.axes = ["phase-x", "phase-y"].map((id) => document.getElementById(id));
    for (const axis of this.axes) {
      axis.append(...options());
      axis.addEventListener("change", () => this.choosePhase(...this.axes.map((x) => x.value)));
    }
  }

  /** Shows these variables over the time. */
  choose(names) {
    this.lines = [...new Set(names)].filter((name) => this.named(name));
    const chips = document.getElementById("lines");
    chips.replaceChildren(
      ...this.lines.map((name, k) => {
        const chip = document.createElement("button");
        Object.assign(chip, { type: "button", textContent: name, title: `Leave out ${name}` });
        chip.style.setProperty("--line", this.page.colors(`series${k}`));
        chip.addEventListener("click", () => this.choose(this.lines.filter((other) => other !== name)));
        return chip;
      }),
    );
    this.rebuild();
  }

  choosePhase(x, y) {
    this.pair = [x, y].map((name, k) => this.named(name) ?? this.variables[k]);
    this.axes.forEach((axis, k) => (axis.value = this.pair[k].name));
    this.version = null;
    this.page.changed();
  }

  /** The plots with their columns: functions of a run. */
  columns() {
    const line = (name, k) => ({ label: label(this.named(name)), color: `series${k}`, column: this.of(name) });
    const groups = [["time-plot", this.lines.map(line)]];
    const energies = ENERGIES.filter((name) => this.named(name));
    if (energies.length) groups.push(["energy-plot", energies.map(line)]);
    const energy = this.named("generalized_energy");
    if (energy) {
      const column = (run) => balance(run, energy, this.named("dissipated_energy"));
      groups.push(["balance-plot", [{ label: "balance, J", color: "series4", column }]]);
    }
    return groups;
  }

  of(name) {
    return (run) => columnOf(run, this.named(name));
  }

  rebuild() {
    for (const { plot } of this.plots) plot.destroy();
    const grey = this.page.grey;
    this.plots = this.columns().map(([id, lines]) => {
      const host = document.getElementById(id);
      host.parentElement.hidden = false;
      const series = [...lines, ...(grey ? lines.map((line) => ({ ...line, color: "grey", grey: true })) : [])];
      return { plot: new TimePlot(host, series, this.page.colors, this.seek), lines };
    });
    this.version = null;
    this.page.changed();
  }

  /** Brings everything up to date with the run. */
  update(time) {
    const { run, grey } = this.page;
    if (this.version !== run.version && (run.done || performance.now() - (this.last ?? 0) > 150)) {
      this.version = run.version;
      this.last = performance.now();
      this.refill(run, grey);
    }
    const index = Math.min(run.values.length - 1, Math.round(time / run.timeOf(1)));
    for (const { plot } of this.plots) plot.at(time, index);
    const value = (of, variable) => shown(variable, of.valueAt(variable, Math.min(time, of.end)));
    const place = (of) => this.pair.map((variable) => value(of, variable));
    this.phase.draw(place(run), grey ? place(grey) : null);
  }

  refill(run, grey) {
    const times = run.times();
    for (const { plot, lines } of this.plots) {
      const mine = lines.map((line) => line.column(run));
      const theirs = grey ? lines.map((line) => padded(line.column(grey), times.length)) : [];
      plot.show([times, ...mine, ...theirs], run.experiment.stop, run.marks);
    }
    const pair = (of) => ({ xs: columnOf(of, this.pair[0]), ys: columnOf(of, this.pair[1]) });
    const { xs, ys } = pair(run);
    this.phase.show(xs, ys, grey ? pair(grey) : null, this.pair.map(label));
  }

  resize() {
    for (const { plot } of this.plots) plot.resize();
    this.page.changed();
  }
}

const label = (variable) => (variable.unit ? `${variable.name}, ${variable.unit}` : variable.name);

/** A variable over the run, in the unit that the user sees. */
const columnOf = (run, variable) => run.column(variable).map((x) => shown(variable, x));

const padded = (column, length) => Array.from({ length }, (_, i) => column[i] ?? null);

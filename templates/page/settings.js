/** Sliders for parameters, inputs and start values, with their units. */

const STEPS = 400;

/** Conversions of a value to the unit that the user sees, and back. */
const shown = (variable, value) => (value - variable.offset) / variable.factor;
const toSi = (variable, value) => value * variable.factor + variable.offset;

/** The least number with one significant digit that is not less than x. */
function nice(x) {
  const power = 10 ** Math.floor(Math.log10(x));
  return [1, 2, 5, 10].map((digit) => digit * power).find((y) => y >= x * 0.999999);
}

/** The range of a slider in the unit that the user sees; `swing` is a typical size of a variable that starts at 0. */
function rangeOf(variable, swing) {
  const start = shown(variable, variable.start);
  let [least, most] = [start / 2, 2 * start];
  if (variable.kind === "input" || variable.kind === "coordinate" || variable.kind === "velocity" || start === 0) {
    const size = Math.max(Math.abs(start), nice(swing || 1));
    [least, most] = [-size, size];
    if (variable.kind === "coordinate") [least, most] = [start - size, start + size];
  }
  if (least > most) [least, most] = [most, least];
  if (variable.min !== null) least = shown(variable, variable.min);
  if (variable.max !== null) most = shown(variable, variable.max);
  return most > least ? [least, most] : [least - 1, least + 1];
}

function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

/** The pieces of a name or unit, between which a line may break: after an underscore or a slash. */
const pieces = (text) => text.split(/(?<=[_/])/).flatMap((piece) => [piece, element("wbr")]);

/** The rows of sliders; `change(variable, value)` is called with SI values. */
class Settings {
  constructor(host, groups, swings, change) {
    this.rows = new Map();
    for (const [heading, variables, open] of groups) {
      if (variables.length === 0) continue;
      const group = element("details", open ? { open: "" } : {}, element("summary", {}, heading));
      for (const variable of variables) group.append(this.row(variable, swings(variable), change));
      host.append(group);
    }
  }

  row(variable, swing, change) {
    const [least, most] = rangeOf(variable, swing);
    const label = `${variable.name}${variable.unit ? `, ${variable.unit}` : ""}`;
    const slider = element("input", {
      type: "range",
      min: least,
      max: most,
      step: nice((most - least) / STEPS),
      "aria-label": `${label}: ${variable.doc}`,
      "data-name": variable.name,
    });
    const field = element("input", { type: "text", inputmode: "decimal", "aria-label": `${label}, as a number` });
    const put = (value) => {
      field.classList.remove("wrong");
      change(variable, toSi(variable, value));
    };
    slider.addEventListener("input", () => put(Number(slider.value)));
    slider.addEventListener("dblclick", () => put(shown(variable, variable.start)));
    field.addEventListener("change", () => {
      const value = Number(field.value.replace(",", "."));
      const outside = (bound, sign) => bound !== null && sign * toSi(variable, value) > sign * bound;
      const bad = !Number.isFinite(value) || outside(variable.min, -1) || outside(variable.max, 1);
      field.classList.toggle("wrong", bad);
      if (!bad) put(value);
    });
    this.rows.set(variable.index, { variable, slider, field });
    const unit = element("span", { class: "unit" }, ...pieces(variable.unit ?? ""));
    const name = element("span", { class: "name", title: variable.doc }, ...pieces(variable.name));
    return element("label", { class: "row", title: variable.doc }, name, slider, field, unit);
  }

  /** Shows a value (SI). */
  set(variable, value) {
    const row = this.rows.get(variable.index);
    if (!row) return;
    row.slider.value = shown(variable, value);
    if (document.activeElement !== row.field) row.field.value = number(shown(variable, value));
    row.field.parentElement.classList.toggle("changed", value !== variable.start);
  }
}

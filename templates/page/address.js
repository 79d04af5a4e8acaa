/** The state of the page in its address, behind the #. */

/** {settings, grey: Maps of variable index to value, or null; the words stop, speed, t, plot, phase, paused}. */
function readAddress(hash, variables) {
  const byName = new Map(variables.map((variable) => [variable.name, variable]));
  const found = { settings: new Map(), grey: null, words: {} };
  for (const [key, text] of new URLSearchParams(hash.replace(/^#/, ""))) {
    const [owner, name] = key.startsWith("grey.") ? ["grey", key.slice(5)] : ["settings", key];
    const variable = byName.get(name);
    if (key === "grey") {
      found.grey ??= new Map();
    } else if (variable && text !== "" && Number.isFinite(Number(text))) {
      found[owner] ??= new Map();
      found[owner].set(variable.index, Number(text));
    } else {
      found.words[key.replace(/^-/, "")] = text;
    }
  }
  return found;
}

/** The text behind the # for this state; a word begins with "-", so that it cannot be the name of a variable. */
function addressOf(state, variables) {
  const named = new Map(variables.map((variable) => [variable.index, variable]));
  const entries = new URLSearchParams();
  for (const [owner, prefix] of [
    ["settings", ""],
    ["grey", "grey."],
  ]) {
    for (const [index, value] of state[owner] ?? []) {
      const variable = named.get(index);
      if (value !== variable.start) entries.set(prefix + variable.name, Number(value.toPrecision(12)));
    }
  }
  if (state.grey) entries.set("grey", "1");
  for (const [word, value] of Object.entries(state.words)) if (value !== "") entries.set(`-${word}`, value);
  return entries.toString();
}

/** The mechanism in WebAssembly: the C sources of the FMU behind the gate of runtime/page/page.h. */

const UTF8 = new TextDecoder();

/** Loads `module` (bytes of WebAssembly) and answers with the Mechanism in it. */
async function loadMechanism(module) {
  const { instance } = await WebAssembly.instantiate(module, {});
  instance.exports._initialize();
  return new Mechanism(instance.exports);
}

/** One instance; all values are in SI units. Its arrays are views of its memory, which callers copy to keep. */
class Mechanism {
  constructor(functions) {
    this.call = functions;
    const memory = functions.memory.buffer;
    const sizes = new Int32Array(memory, functions.page_sizes(), 7);
    [this.states, this.inputs, this.parameters, this.coordinates, this.variables] = sizes;
    const size = this.states + this.inputs + this.parameters;
    this.point = new Float64Array(memory, functions.page_point(), size);
    this.values = new Float64Array(memory, functions.page_values(), this.variables);
    this.spots = new Float64Array(memory, functions.page_draw(0), sizes[5]);
    this.powers = new Float64Array(memory, functions.page_power(), 2);
    this.state = new Uint8Array(memory, functions.page_state(), sizes[6]);
  }

  /** Solves for the start of an experiment: `settings` is a Map of variables, by value reference, to values. */
  begin(experiment, settings) {
    this.call.page_begin(0, experiment.stop, experiment.tolerance);
    for (const [variable, value] of settings) this.call.page_set(variable, value);
    return this.call.page_settle() === 1;
  }

  set(variable, value) {
    this.call.page_set(variable, value);
  }

  /** Goes to the time `end` and returns whether that was possible, or "event" at an event before `end`. */
  advance(end) {
    return [false, true, "event"][this.call.page_advance(end)];
  }

  /** Goes over the event; false if that was not possible. */
  pass() {
    return this.call.page_pass() === 1;
  }

  get time() {
    return this.call.page_time();
  }

  /** Updates `point`; returns the `values` of variables, the `power` (W) of everything that changes the energy, and
   *  whether supports are `moving`. */
  observe() {
    this.call.page_observe();
    this.call.page_power();
    const [power, moving] = this.powers;
    return { values: this.values.slice(), power, moving: moving !== 0 };
  }

  /** The spots of the picture at a `time` and the present `point`. */
  draw(time) {
    this.call.page_draw(time);
    return this.spots;
  }

  restore(state) {
    this.state.set(state);
    this.call.page_restored();
  }

  /** Why the last call failed. */
  get sentence() {
    const memory = new Uint8Array(this.call.memory.buffer);
    const begin = this.call.page_sentence();
    return UTF8.decode(memory.subarray(begin, memory.indexOf(0, begin)));
  }
}

// Runs a component that jco has transpiled, in Node, as component_host.c runs an FMU. Arguments: folder, name, token,
// length of a step (s), number of steps, number of variables.
import { readFileSync } from "node:fs";

const [folder, name, token, step, count, variables] = process.argv.slice(2);
const module = (file) => WebAssembly.compile(readFileSync(`${folder}/${file}`));
const { instantiate } = await import(`${folder}/${name}.js`);
const said = [];
const logger = { logMessage: (...words) => said.push(words) };
const { coSimulation } = await instantiate(module, { "fmi:fmi3/callbacks": logger, "fmi:fmi3/types": {} });
const kind = coSimulation.CoSimulationInstance;
const fmu = kind.instantiateCoSimulation("node", token, "", false, false, false, false, new Uint32Array());
fmu.enterInitializationMode(undefined, 0, undefined);
fmu.exitInitializationMode();
const references = Uint32Array.from({ length: Number(variables) }, (_, i) => i);
const rows = [];
for (let i = 0; i < Number(count); i++) {
  fmu.doStep(i * Number(step), Number(step), true);
  rows.push([...fmu.getFloat64(references)]);
}
const state = fmu.getFmuState();
fmu.setFmuState(state);
console.log(JSON.stringify({ rows, state: [...state], said }));

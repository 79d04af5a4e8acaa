// Runs a component that jco has transpiled, in Node, as component_host.c runs an FMU. Arguments: folder, name, token,
// CoSimulation or ModelExchange, length of a step (s), number of steps, number of variables.
import { readFileSync } from "node:fs";

const [folder, name, token, kind, ...numbers] = process.argv.slice(2);
const [step, count, variables] = numbers.map(Number);
const module = (file) => WebAssembly.compile(readFileSync(`${folder}/${file}`));
const { instantiate } = await import(`${folder}/${name}.js`);
const said = [];
const logger = { logMessage: (...words) => said.push(words) };
const { coSimulation, modelExchange } = await instantiate(module, { "fmi:fmi3/callbacks": logger, "fmi:fmi3/types": {} });

function simulate() {
  const instance = coSimulation.CoSimulationInstance;
  const fmu = instance.instantiateCoSimulation("node", token, "", false, false, false, false, new Uint32Array());
  fmu.enterInitializationMode(undefined, 0, undefined);
  fmu.exitInitializationMode();
  const references = Uint32Array.from({ length: variables }, (_, i) => i);
  const rows = [];
  for (let i = 0; i < count; i++) {
    fmu.doStep(i * step, step, true);
    rows.push([...fmu.getFloat64(references)]);
  }
  return [fmu, rows];
}

function exchange() {
  const fmu = modelExchange.ModelExchangeInstance.instantiateModelExchange("node", token, "", false, false);
  fmu.enterInitializationMode(undefined, 0, undefined);
  fmu.exitInitializationMode();
  const settle = () => {
    while (fmu.updateDiscreteStates().newDiscreteStatesNeeded);
    fmu.enterContinuousTimeMode();
  };
  const signs = (z) => [...z].map((value) => value > 0);
  settle();
  const rows = [];
  let before = signs(fmu.getEventIndicators());
  for (let i = 0; i < count; i++) {
    const rates = fmu.getContinuousStateDerivatives();
    const moved = fmu.getContinuousStates().map((x, j) => x + ((i + 1) * step - i * step) * rates[j]);
    fmu.setTime((i + 1) * step);
    fmu.setContinuousStates(moved);
    const { enterEventMode } = fmu.completedIntegratorStep(true);
    const z = fmu.getEventIndicators();
    if (enterEventMode || signs(z).some((sign, j) => sign !== before[j])) {
      fmu.enterEventMode();
      settle();
    }
    before = signs(fmu.getEventIndicators());
    rows.push([...fmu.getContinuousStates(), ...rates, ...z]);
  }
  return [fmu, rows];
}

const [fmu, rows] = kind === "CoSimulation" ? simulate() : exchange();
const state = fmu.getFmuState();
fmu.setFmuState(state);
console.log(JSON.stringify({ rows, state: [...state], said }));

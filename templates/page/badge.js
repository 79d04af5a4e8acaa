/** The comparison of the page's own trajectory with the one by direct integration that the page contains. */

/** The largest difference, relative to the ranges of the variables and to the growth of disturbances of the start. */
function compare(run, reference, variables) {
  const byName = new Map(variables.map((variable) => [variable.name, variable]));
  const columns = reference.names.map((name) => byName.get(name));
  let worst = 0;
  reference.times.forEach((time, k) => {
    const row = run.values[Math.round(time / run.timeOf(1))];
    columns.forEach((variable, i) => {
      const error = Math.abs(row[variable.index] - reference.values[k][i]) / reference.scales[i];
      worst = Math.max(worst, error / reference.growth[k]);
    });
  });
  return worst;
}

/** The text of the badge for a comparison of the `reference`; "" as long as there is none. */
function verdict(worst, { bar, until }) {
  const passed = worst <= bar;
  const when = until === null ? "" : ` until ${until.toPrecision(3)} s`;
  return {
    passed,
    text: passed
      ? `Agrees with direct integration${when} to ${worst.toExponential(0)}`
      : "Differs from direct integration",
    title:
      `The page computes the default experiment by the C sources of the FMU. Beside it stands a trajectory by direct ` +
      `integration of equations that were obtained on another path. The largest difference is ` +
      `${worst.toExponential(1)} of a variable's range, the growth of disturbances taken out; ${bar} is allowed.` +
      (when && ` The direct integration came${when} in its time; nothing was compared from there on.`),
  };
}

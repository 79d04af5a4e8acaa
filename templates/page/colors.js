/** The colours of the drawing and the plots, for light and dark. */

const LIGHT = {
  ground: "#7d8b99",
  axis: "#9aa7b4",
  guide: "#9aa7b4",
  link: "#44525f",
  edge: "#27435c",
  rod: "#a9c6df",
  body: "#cfdfec",
  mass: "#4c86b8",
  paper: "#ffffff",
  spring: "#c05f1f",
  damper: "#6b4fa0",
  load: "#b3261e",
  trail: "#4c86b8",
  text: "#33434f",
  grid: "#e3e9ee",
  grey: "#9aa5af",
  mark: "#e0b58a",
  series0: "#2f6ea5",
  series1: "#c05f1f",
  series2: "#1d7a4c",
  series3: "#6b4fa0",
  series4: "#a33a6b",
  series5: "#7d6a12",
};

const DARK = {
  ground: "#8695a3",
  axis: "#75838f",
  guide: "#75838f",
  link: "#b8c4cf",
  edge: "#9fc3e2",
  rod: "#37536c",
  body: "#2b4257",
  mass: "#5d9ed6",
  paper: "#131a21",
  spring: "#f0975a",
  damper: "#b197ea",
  load: "#ff8a80",
  trail: "#5d9ed6",
  text: "#c3ced8",
  grid: "#2a343e",
  grey: "#6a7680",
  mark: "#7d5c3c",
  series0: "#6db1ea",
  series1: "#f0975a",
  series2: "#5fc894",
  series3: "#b197ea",
  series4: "#ee82b2",
  series5: "#d3bd53",
};

const dark = window.matchMedia("(prefers-color-scheme: dark)");

/** The colour of a style in the user's present scheme, light or dark; a colour of its own stays. */
const colorOf = (style) => (style.startsWith("#") ? style : (dark.matches ? DARK : LIGHT)[style]);

const onSchemeChange = (listen) => dark.addEventListener("change", listen);

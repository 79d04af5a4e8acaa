/** Which view shows a mechanism, and how large. */

import { GaugesView } from "./gauges.js";
import { PlaneView } from "./plane.js";
import { makeSpaceView } from "./space.js";

const SMALL = 50;
const PLACED = ["still", "rail", "pulley"];

/** The view of a page: gauges where nothing can be drawn, else in the plane or, with `three`, in space. */
export function makeView(page, three) {
  const canvas = document.getElementById("view");
  if (!page.drawing) return new GaugesView(canvas, page.coordinates, page.colors);
  if (page.drawing.planar || !three) return new PlaneView(canvas, page.drawing, page.colors);
  return makeSpaceView(three, canvas, page.drawing, page.colors);
}

/** Gives what moves little, such as a single particle, the whole picture, unless something is drawn at a distance. */
export function enlarge(drawing, run) {
  if (!drawing || drawing.items.some((item) => item.wall || PLACED.includes(item.k))) return;
  const view = new PlaneView(null, drawing, null);
  for (let k = 0; k < run.points.length; k += Math.ceil(run.count / 200)) {
    run.mechanism.point.set(run.points[k]);
    view.include(run.mechanism.draw(run.timeOf(k)));
  }
  const [left, bottom, right, top] = view.box;
  const extent = Math.max(right - left, top - bottom);
  if (extent > 1e-6 && extent < SMALL) drawing.unit *= extent / SMALL;
}

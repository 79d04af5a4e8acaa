/** The choice of the view that shows a mechanism, and of its size. */

const SMALL = 50;
const PLACED = ["still", "rail", "pulley"];

/** The view of a page: in the plane, with `three` in space, or gauges if there is nothing to draw. */
function makeView(page, three) {
  const canvas = document.getElementById("view");
  if (!page.drawing) return new GaugesView(canvas, page.coordinates, page.colors);
  if (page.drawing.planar || !three) return new PlaneView(canvas, page.drawing, page.colors);
  return makeSpaceView(three, canvas, page.drawing, page.colors);
}

/** Enlarges a mechanism that moves little, such as a single particle, unless something is drawn far from it. */
function enlarge(drawing, run) {
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

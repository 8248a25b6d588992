// A plan drawn on the map: points, survey areas, loiters and stations.
import { button, fill, make, page, post, store, write } from "./page.js";
import { makeLayer, map } from "./map_layer.js";

const COLOR = "#c51b7d";
const CORNERS = { rows: 3 }; // places of a shape; otherwise one
const HINTS = ["", "Press on the end of the first row.", "Press on the far side of the area."]; // after so many corners

const marks = makeLayer(), track = makeLayer();
const kinds = Object.fromEntries([...page.drawKind.options].map(({ value, label }) => [value, label]));
const text = page.planText;
let asked = 0; // times for a text
let written = ""; // the latest text of what is drawn
let shapes = [];
let corners = []; // of a shape that is not finished

// The plan as text, or null with the reason beside the list. Draws its path, and shows the text where nobody has
// written another one, or if it `replaces` that.
export async function readText(replaces = true) {
  const mine = ++asked, answer = await post("plan-draw", { name: page.drawName.value, shapes });
  if (mine !== asked) return null;
  if (!answer.ok) write(page.drawHint, answer.text, "bad");
  track.clear();
  track.line((answer.path ?? []).flatMap(({ places }) => places), { color: COLOR });
  if (!answer.ok) return null;
  const drawn = isEmpty() ? "" : answer.text;
  if (replaces && drawn || ["", written].includes(text.value)) text.value = written = drawn;
  return drawn || null;
}

function drawMarks() {
  marks.clear();
  for (const place of [...shapes.flatMap(({ places }) => places), ...corners]) marks.dot(place, { color: COLOR });
  for (const { kind, places, radius } of shapes) {
    if (kind === "loiter" || kind === "station_keeping") marks.circle(places[0], { radius, color: COLOR, fill: false });
  }
}

function line(shape, at) {
  const field = (name, label, step) => {
    const onchange = ({ target }) => { shape[name] = Number(target.value); readText(false); };
    return make("label", [`${label} `, make("input", "", { type: "number", step, value: shape[name], onchange })]);
  };
  return make("li", [make("span", `${at + 1} ${kinds[shape.kind]}`), field("z", `${shape.reference} (m)`, 0.5),
    field("speed", "speed (m/s)", 0.1), button("Remove", () => change(shapes.filter((each) => each !== shape)))]);
}

function change(made) {
  [shapes, corners] = [made, []];
  page.drawPoints.value = shapes.length;
  fill(page.drawnList, shapes.map(line));
  write(page.drawHint, "");
  drawMarks();
  readText(false);
}

function addPlace({ lat, lng }) {
  const kind = page.drawKind.value;
  corners.push([lat, lng]);
  if (corners.length < (CORNERS[kind] ?? 1)) {
    write(page.drawHint, HINTS[corners.length]);
    drawMarks();
    return;
  }
  const [z, speed, radius, seconds, spacing] =
    ["Depth", "Speed", "Radius", "Seconds", "Spacing"].map((name) => Number(page[`draw${name}`].value));
  change([...shapes, { kind, places: corners, z, reference: page.drawReference.value, speed, radius, seconds, spacing }]);
}

page.drawKind.onchange = () => change(shapes);
page.drawUndo.onclick = () => change(corners.length ? shapes : shapes.slice(0, -1));
map?.on("click", ({ latlng }) => { if (store.drawing && !store.measuring) addPlace(latlng); });
export const isEmpty = () => !shapes.length;

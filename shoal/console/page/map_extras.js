// On the map: overlays of charts, limits and detections of the chosen vehicle, and distances.
import { ask, make, makeAsk, page, press, repeat, say, store, untilDone, write } from "./page.js";
import { L, makeLayer, map } from "./map_layer.js";

const SMALL = 1 << 20; // bytes of an overlay that is drawn unasked
const RENEWED = 30000, DETECTED = 2000; // ms between questions for limits and detections
const FADED = 60; // s, after which a detection is pale
const PATIENCE = 60000; // ms for an overlay
const SEA = { color: "#35617d", weight: 1 }, BORDER = "#6a4c93", DANGER = "#b3121d", RULER = "#111";
const STYLES = {
  contour: SEA, land: { color: "#7a6a3a", weight: 1, fillOpacity: 0.35 },
  obstruction: { color: DANGER, weight: 2 }, area: { color: BORDER, weight: 1, dashArray: "4 3", fillOpacity: 0.04 },
  line: { color: BORDER, weight: 2 }, mark: { color: "#1b7837", weight: 2 }, sounding: SEA,
};

const detected = makeLayer(), limits = makeLayer(), ruler = makeLayer();
const aboutLimits = makeAsk(), aboutObjects = makeAsk();
let places = []; // of the ruler

const describe = ({ kind, name, depth }) => [kind, name, Number.isFinite(depth) && `${depth} m`].filter(Boolean).join(" · ");

async function addOverlay(layer, name) {
  const found = await ask("overlay", { name }, PATIENCE);
  if (!found.features) { layer.wanted = false; return; }
  L.geoJSON(found, {
    style: ({ properties }) => STYLES[properties.kind],
    pointToLayer: ({ properties }, place) => L.circleMarker(place, { ...STYLES[properties.kind], radius: 3 }),
    onEachFeature: ({ properties }, each) => each.bindTooltip(make("span", describe(properties))),
  }).addTo(layer);
}

const addOverlays = untilDone(async () => {
  const { sizes, troubles } = await ask("overlays", {}, PATIENCE);
  if (!sizes) return false;
  if (troubles.length) say(troubles.join("; "), "warn");
  if (!Object.keys(sizes).length) return true;
  const control = L.control.layers({}, {}, { collapsed: false, position: "bottomleft" }).addTo(map);
  for (const [name, size] of Object.entries(sizes)) {
    const layer = L.layerGroup();
    layer.on("add", () => { if (!layer.wanted) { layer.wanted = true; addOverlay(layer, name); } });
    control.addOverlay(layer, name.replace(/[<>&]/g, "?")); // Leaflet takes markup
    if (size <= SMALL) layer.addTo(map);
  }
  return true;
});

async function showLimits() {
  const found = await aboutLimits("limits");
  if (!found?.ok) return;
  limits.clear();
  if (found.area) limits.area(found.area, { color: DANGER, dashArray: "8 6", fill: false });
  write(page.limits, found.text);
}

async function showDetections() {
  const found = await aboutObjects("detections");
  if (!found) return;
  detected.clear();
  for (const { label, lat, lon, age } of found.objects ?? []) {
    detected.dot([lat, lon], { radius: 6, color: "#d95f02", weight: 2, fill: false, opacity: age > FADED ? 0.4 : 1 },
      `${label}, ${age.toFixed(0)} s ago`);
  }
}

function drawRuler() {
  ruler.clear();
  ruler.line(places, { color: RULER, dashArray: "2 5" });
  for (const place of places) ruler.dot(place, { radius: 3, color: RULER });
  const legs = places.slice(1).map((place, at) => map.distance(places[at], place));
  const last = legs.length ? `, last leg ${legs.at(-1).toFixed(0)} m toward ${bearing(...places.slice(-2))}°` : "";
  const total = legs.reduce((sum, leg) => sum + leg, 0);
  write(page.measured, store.measuring ? `${total.toFixed(0)} m${last}` : "");
}

page.measure.onclick = ({ target }) => {
  store.measuring = !store.measuring;
  places = [];
  press(target, store.measuring, "End measuring", "Measure");
  drawRuler();
};
map?.on("click", ({ latlng }) => {
  if (store.measuring) { places.push(latlng); drawRuler(); }
});
page.measure.hidden = !map;
export function choose() {
  limits.clear();
  detected.clear();
  write(page.limits, "");
  showLimits();
}
export const draw = () => { if (map) addOverlays(); };
repeat(showLimits, () => RENEWED);
repeat(showDetections, () => DETECTED);

// Degrees from north: the projection of the map keeps angles.
function bearing(from, to) {
  const { x, y } = map.project(to).subtract(map.project(from));
  return ((Math.atan2(x, -y) * 180 / Math.PI + 360) % 360).toFixed(0);
}

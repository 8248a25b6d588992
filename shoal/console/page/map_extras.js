// Beside vehicles on the map: overlays of charts, the limits of the chosen vehicle, and a tool for distances.
import { ask, element, make, say } from "./page.js";

const SMALL = 1 << 20; // bytes of an overlay that is drawn without being asked for
const RENEWED = 30000; // ms between questions for limits
const DETECTED = 2000; // ms between questions for detections
const FADED = 60; // s, after which a detection is pale
const PATIENCE = 60000; // ms for an overlay
const STYLES = {
  contour: { color: "#35617d", weight: 1 }, land: { color: "#7a6a3a", weight: 1, fillOpacity: 0.35 },
  obstruction: { color: "#b3121d", weight: 2 }, area: { color: "#6a4c93", weight: 1, dashArray: "4 3", fillOpacity: 0.04 },
  line: { color: "#6a4c93", weight: 2 }, mark: { color: "#1b7837", weight: 2 }, sounding: { color: "#35617d", weight: 1 },
};

export function makeMapExtras(store) {
  const { L } = window, { map } = store;
  if (!map) {
    element("measure").hidden = true;
    return { draw: () => {} };
  }
  const detected = L.layerGroup().addTo(map), limits = L.layerGroup().addTo(map), ruler = L.layerGroup().addTo(map);
  let asked = false;
  let limited = ""; // the vehicle whose limits are drawn
  let places = [];

  const describe = ({ kind, name, depth }) =>
    [kind, name, depth === undefined ? "" : `${depth} m`].filter(Boolean).join(" · ");

  const fill = async (layer, name) => {
    const found = await ask("/api/overlay", { name }, PATIENCE);
    if (!found.features) { layer.wanted = false; return; }
    L.geoJSON(found, {
      style: ({ properties }) => STYLES[properties.kind],
      pointToLayer: ({ properties }, place) => L.circleMarker(place, { ...STYLES[properties.kind], radius: 3 }),
      onEachFeature: ({ properties }, each) => each.bindTooltip(make("span", describe(properties))),
    }).addTo(layer);
  };

  const addOverlays = async () => {
    const { sizes, troubles } = await ask("/api/overlays", {}, PATIENCE);
    if (!sizes) { asked = false; return; }
    if (troubles.length) say(troubles.join("; "), "warn");
    if (!Object.keys(sizes).length) return;
    const control = L.control.layers({}, {}, { collapsed: false, position: "bottomleft" }).addTo(map);
    for (const [name, size] of Object.entries(sizes)) {
      const layer = L.layerGroup();
      layer.on("add", () => { if (!layer.wanted) { layer.wanted = true; fill(layer, name); } });
      control.addOverlay(layer, name.replace(/[<>&]/g, "?")); // Leaflet takes markup
      if (size <= SMALL) layer.addTo(map);
    }
  };

  const showLimits = async () => {
    const vehicle = store.chosen;
    if (!vehicle || document.hidden) return;
    limited = vehicle;
    const found = await ask("/api/limits", { vehicle });
    if (vehicle !== store.chosen || !found.ok) return;
    limits.clearLayers();
    const words = [];
    if (found.area) {
      words.push("operating area dashed");
      L.polygon(found.area, { color: "#b3121d", weight: 2, dashArray: "8 6", fill: false, interactive: false }).addTo(limits);
    }
    if (found.max_depth !== undefined) words.push(`depth to ${found.max_depth} m`);
    if (found.min_altitude !== undefined) words.push(`altitude from ${found.min_altitude} m`);
    if (found.max_altitude !== undefined) words.push(`altitude to ${found.max_altitude} m`);
    if (found.max_speed !== undefined) words.push(`speed to ${found.max_speed} m/s`);
    element("limits").textContent = words.length ? `Limits: ${words.join(", ")}` : "";
  };

  const showDetections = async () => {
    const vehicle = store.chosen;
    if (!vehicle || document.hidden) return;
    const { objects } = await ask("/api/detections", { vehicle });
    if (!objects || vehicle !== store.chosen) return;
    detected.clearLayers();
    for (const { label, lat, lon, age } of objects) {
      const style = { radius: 6, color: "#d95f02", weight: 2, fill: false, opacity: age > FADED ? 0.4 : 1 };
      L.circleMarker([lat, lon], style).addTo(detected).bindTooltip(make("span", `${label}, ${age.toFixed(0)} s ago`));
    }
  };

  const drawRuler = () => {
    ruler.clearLayers();
    L.polyline(places, { color: "#111", weight: 2, dashArray: "2 5", interactive: false }).addTo(ruler);
    for (const place of places) L.circleMarker(place, { radius: 3, color: "#111", interactive: false }).addTo(ruler);
    let total = 0;
    for (let at = 1; at < places.length; at += 1) total += map.distance(places[at - 1], places[at]);
    const last = places.length > 1 ? `, last leg ${map.distance(places.at(-2), places.at(-1)).toFixed(0)} m toward ` +
      `${bearing(places.at(-2), places.at(-1)).toFixed(0)}°` : "";
    element("measured").textContent = store.measuring ? `${total.toFixed(0)} m${last}` : "";
  };

  element("measure").onclick = ({ target }) => {
    store.measuring = !store.measuring;
    places = [];
    target.setAttribute("aria-pressed", String(store.measuring));
    target.textContent = store.measuring ? "End measuring" : "Measure";
    drawRuler();
  };
  map.on("click", ({ latlng }) => {
    if (!store.measuring) return;
    places.push(latlng);
    drawRuler();
  });
  setInterval(showLimits, RENEWED);
  setInterval(showDetections, DETECTED);

  const draw = () => {
    if (!asked) { asked = true; addOverlays(); }
    if (store.chosen && limited !== store.chosen) {
      limits.clearLayers();
      detected.clearLayers();
      element("limits").textContent = "";
      showLimits();
    }
  };
  return { draw };
}

// Degrees from north, between near places.
function bearing(from, to) {
  const east = (to.lng - from.lng) * Math.cos(from.lat * Math.PI / 180);
  return (Math.atan2(east, to.lat - from.lat) * 180 / Math.PI + 360) % 360;
}

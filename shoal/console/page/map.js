// On the map: vehicles with heading and uncertainty, tracks colored by depth, plans, tiles.
import { ask, isOld, make, makeAsk, page, placeOf, repeat, store, untilDone, write } from "./page.js";
import { DEEPEST, L, makeLayer, map } from "./map_layer.js";

const DEPTHS = ["#2b8cbe", "#2ca25f", "#d9a400", "#e6550d", "#a50f15"]; // each 10 m deeper
const CONTOUR = "#4a7d9c", PLAN = "#7b3294", UNCERTAINTY = "#0b57a4";
const GRID = { color: "#7d93a3", weight: 0.6 };
const STEP = 10; // m
const FARTHER = 2; // zoom levels at which tiles are smaller: each needs four times as many
const GRATICULE = [10, 1, 0.1, 0.01, 0.001].flatMap((each) => [each, each / 2, each / 5]); // degrees

const grid = makeLayer(), contours = makeLayer(), plan = makeLayer(), about = makeAsk();
const shown = new Map(); // vehicle: { marker, circle, lines, track, dropped, count, line, color, run }
let placed = false;
let tiled = null; // whether there are tiles, once that is known
let drawContours = null;

function drawGrid() {
  grid.clear();
  const [west, south, east, north] = map.getBounds().toBBoxString().split(",").map(Number);
  const step = GRATICULE.find((each) => (north - south) / each >= 4) ?? GRATICULE.at(-1);
  for (let lat = Math.ceil(south / step) * step; lat < north; lat += step) grid.line([[lat, west], [lat, east]], GRID);
  for (let lon = Math.ceil(west / step) * step; lon < east; lon += step) grid.line([[south, lon], [north, lon]], GRID);
}

// One line for each run of one color, which grows until the color changes.
function drawTrack(of, track) {
  if (of.track !== track || of.dropped !== track.dropped) {
    of.lines.clear();
    Object.assign(of, { track, dropped: track.dropped, count: 0, line: null });
  }
  const { points } = track;
  if (of.count === points.length) return;
  for (let at = Math.max(1, of.count); at < points.length; at += 1) {
    const color = DEPTHS[Math.floor(Math.max(0, points[at][2] ?? 0) / STEP)] ?? DEPTHS.at(-1);
    if (!of.line || of.color !== color) {
      of.line?.setLatLngs(of.run);
      Object.assign(of, { line: of.lines.line([], { color, weight: 3 }), color, run: [points[at - 1].slice(0, 2)] });
    }
    of.run.push(points[at].slice(0, 2));
  }
  of.line?.setLatLngs(of.run);
  of.count = points.length;
}

function addVehicle(name, place) {
  const icon = L.divIcon({ className: "arrow", html: "<span>▲</span>", iconSize: [22, 22] });
  const marker = L.marker(place, { icon, alt: name, keyboard: false }).addTo(map).bindTooltip(make("span", name));
  const of = { marker, circle: makeLayer(), lines: makeLayer(), track: null };
  shown.set(name, of);
  return of;
}

function drawVehicles() {
  for (const [name, vehicle] of Object.entries(store.vehicles)) {
    const { state } = vehicle, place = placeOf(state), track = store.tracks[name];
    const first = place ?? track?.points[0]?.slice(0, 2); // in a log, the track is known before the position
    if (!placed && first) { placed = true; map.setView(first, 18); }
    if (!place) continue;
    const of = shown.get(name) ?? addVehicle(name, place);
    of.marker.setLatLng(place).setOpacity(isOld(vehicle) ? 0.4 : 1);
    const arrow = of.marker.getElement()?.firstElementChild;
    if (arrow) arrow.style.transform = `rotate(${state.heading ?? 0}deg)`;
    of.circle.clear();
    if (Number.isFinite(state.uncertainty)) {
      of.circle.circle(place, { radius: Math.max(0.1, 2 * state.uncertainty), color: UNCERTAINTY });
    }
    if (track) drawTrack(of, track);
  }
  for (const [name, { marker, circle, lines }] of shown) {
    if (store.vehicles[name]) continue;
    for (const layer of [marker, circle, lines]) layer.remove();
    shown.delete(name);
  }
}

export function showPath(path, fits = true) {
  plan.clear();
  const places = path.flatMap((leg) => leg.places);
  plan.line(places, { color: PLAN, dashArray: "6 4" });
  for (const leg of path) {
    for (const place of leg.places) plan.dot(place, { color: PLAN }, `${leg.kind} ${leg.z ?? ""} m ${leg.reference}`);
  }
  if (fits) plan.fit(places);
}

async function readTiles() {
  const { sets, troubles = [] } = await ask("tiles");
  write(page.tileTroubles, troubles.join("; "), "warn");
  return sets;
}

const addTiles = untilDone(async () => {
  const sets = await readTiles();
  const layers = {};
  for (const [name, [least, most]] of Object.entries(sets ?? {})) {
    layers[name.replace(/[<>&]/g, "?")] = L.tileLayer(`/tiles/${encodeURIComponent(name)}/{z}/{x}/{y}`,
      { minNativeZoom: least, maxNativeZoom: most, minZoom: Math.max(0, least - FARTHER), maxZoom: DEEPEST });
  }
  const [first] = Object.values(layers);
  first?.addTo(map);
  tiled = sets && Boolean(first);
  // Open, since the icon of a closed one is not served.
  if (first) L.control.layers({}, layers, { collapsed: false }).addTo(map);
  return sets;
});

// Contours of the vehicle's bathymetry, where there are no tiles.
async function readContours() {
  const answer = await about("contours");
  for (const { depth, places } of answer?.lines ?? []) contours.line(places, { color: CONTOUR, weight: 1 }, `${depth} m`);
  return !answer || answer.lines;
}

export function draw() {
  if (!map) return;
  addTiles();
  if (tiled === false) drawContours?.();
  drawVehicles();
}

export function choose() {
  if (!map) return;
  contours.clear();
  drawContours = untilDone(readContours);
  const here = placeOf(store.vehicle()?.state);
  if (here) map.panTo(here);
}

if (map) {
  repeat(() => tiled && readTiles(), () => 30000); // damage is found when a tile is read
  L.control.scale({ imperial: false }).addTo(map);
  drawGrid();
  map.on("moveend zoomend", drawGrid);
  map.on("mousemove", ({ latlng }) => {
    const { lat, lng } = latlng, here = placeOf(store.vehicle()?.state);
    const away = here ? `, ${map.distance(here, latlng).toFixed(0)} m from the vehicle` : "";
    write(page.cursor, `${lat.toFixed(6)}°, ${lng.toFixed(6)}°${away}`);
  });
} else page.map.textContent = "no map: pip install 'shoal[console]' installs Leaflet";

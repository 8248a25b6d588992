// The map: vehicles with heading and uncertainty, tracks colored by depth, plans; tiles of the console only.
import { ask, element, make } from "./page.js";

const DEPTHS = ["#2b8cbe", "#2ca25f", "#d9a400", "#e6550d", "#a50f15"]; // each 10 m deeper
const CONTOUR = "#35617d";
const RETRY = 5000; // ms until contours are asked for again
const STEP = 10; // m
const DEEPEST = 24; // zoom level
const FARTHER = 2; // zoom levels at which tiles are drawn smaller: each level needs four times as many
const GRATICULE = [10, 5, 2, 1, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002, 0.0001]; // degrees

export function makeMap(store) {
  const L = window.L;
  if (!L) {
    element("map").textContent = "Leaflet is not installed (pip install 'shoal[console]'): there is no map.";
    store.showPath = store.showFlight = () => {};
    return { draw: () => {}, resize: () => {} };
  }
  const map = L.map("map", { attributionControl: false, preferCanvas: true, minZoom: 0, maxZoom: DEEPEST });
  map.setView([0, 0], 2);
  L.control.scale({ imperial: false }).addTo(map);
  const grid = L.layerGroup().addTo(map), plan = L.layerGroup().addTo(map);
  const shown = new Map(); // vehicle: { marker, circle, lines, track, dropped, count, line, color, run }
  const contours = L.layerGroup().addTo(map), flight = L.layerGroup().addTo(map);
  store.map = map; // for views that draw layers of their own
  let placed = false;
  let contoured = ""; // the vehicle whose contours are drawn
  let tiled = false;

  const drawGrid = () => {
    grid.clearLayers();
    const bounds = map.getBounds();
    const span = Math.max(bounds.getNorth() - bounds.getSouth(), 1e-6);
    const step = GRATICULE.find((each) => span / each >= 4) ?? GRATICULE.at(-1);
    const style = { color: "#7d93a3", weight: 0.6, interactive: false };
    for (let lat = Math.ceil(bounds.getSouth() / step) * step; lat < bounds.getNorth(); lat += step) {
      L.polyline([[lat, bounds.getWest()], [lat, bounds.getEast()]], style).addTo(grid);
    }
    for (let lon = Math.ceil(bounds.getWest() / step) * step; lon < bounds.getEast(); lon += step) {
      L.polyline([[bounds.getSouth(), lon], [bounds.getNorth(), lon]], style).addTo(grid);
    }
  };

  // One line for each run of one color, which grows until the color changes.
  const drawTrack = (of, track) => {
    if (of.track !== track || of.dropped !== track.dropped) {
      of.lines.clearLayers();
      Object.assign(of, { track, dropped: track.dropped, count: 0, line: null });
    }
    const { points } = track;
    if (of.count === points.length) return;
    for (let at = Math.max(1, of.count); at < points.length; at += 1) {
      const color = DEPTHS[Math.min(DEPTHS.length - 1, Math.floor(Math.max(0, points[at][2] ?? 0) / STEP))];
      if (!of.line || of.color !== color) {
        of.line?.setLatLngs(of.run);
        of.line = L.polyline([], { color, weight: 2, interactive: false }).addTo(of.lines);
        of.color = color;
        of.run = [points[at - 1].slice(0, 2)];
      }
      of.run.push(points[at].slice(0, 2));
    }
    of.line?.setLatLngs(of.run);
    of.count = points.length;
  };

  const draw = () => {
    for (const [name, vehicle] of Object.entries(store.vehicles)) {
      const { lat, lon, heading, uncertainty } = vehicle.state ?? {};
      if (lat === undefined || lat === null) continue;
      let of = shown.get(name);
      if (!of) {
        const icon = L.divIcon({ className: "arrow", html: "<span>▲</span>", iconSize: [22, 22] });
        of = { marker: L.marker([lat, lon], { icon, alt: name, keyboard: false }).addTo(map), circle: null,
          lines: L.layerGroup().addTo(map), track: null };
        of.marker.bindTooltip(make("span", name));
        shown.set(name, of);
      }
      of.marker.setLatLng([lat, lon]);
      const arrow = of.marker.getElement()?.firstElementChild;
      if (arrow) arrow.style.transform = `rotate(${heading ?? 0}deg)`;
      of.marker.setOpacity(vehicle.system?.there ? 1 : 0.4);
      if (uncertainty !== null && uncertainty !== undefined) {
        of.circle ??= L.circle([lat, lon], { radius: 1, color: "#0b57a4", weight: 1, interactive: false }).addTo(map);
        of.circle.setLatLng([lat, lon]).setRadius(Math.max(0.1, 2 * uncertainty));
      } else {
        of.circle?.remove();
        of.circle = null;
      }
      if (store.tracks[name]) drawTrack(of, store.tracks[name]);
      if (!placed) { placed = true; map.setView([lat, lon], 16); }
    }
    for (const [name, of] of shown) {
      if (store.vehicles[name]) continue;
      for (const layer of [of.marker, of.circle, of.lines]) layer?.remove();
      shown.delete(name);
    }
  };

  store.showPath = (path, fits = true) => {
    plan.clearLayers();
    const places = path.flatMap((leg) => leg.places);
    if (places.length > 1) L.polyline(places, { color: "#7b3294", weight: 2, dashArray: "6 4" }).addTo(plan);
    for (const leg of path) {
      for (const place of leg.places) {
        L.circleMarker(place, { radius: 4, color: "#7b3294" }).addTo(plan)
          .bindTooltip(make("span", `${leg.kind} ${leg.z ?? ""} m ${leg.reference}`));
      }
    }
    if (places.length && fits) map.fitBounds(L.latLngBounds(places).pad(0.3), { maxZoom: 17 });
  };
  store.showFlight = (rows) => {
    flight.clearLayers();
    const places = rows.filter(([, lat, lon]) => lat !== null && lon !== null).map(([, lat, lon]) => [lat, lon]);
    if (!places.length) return;
    L.polyline(places, { color: "#e7298a", weight: 3, opacity: 0.6 }).addTo(flight)
      .bindTooltip(make("span", "flown in virtual time"));
    map.fitBounds(L.latLngBounds(places).pad(0.3), { maxZoom: 17 });
  };

  map.on("moveend zoomend", drawGrid);
  map.on("click", (event) => store.drawing && !store.measuring && store.addPoint(event.latlng.lat, event.latlng.lng));
  map.on("mousemove", (event) => {
    const { lat, lng } = event.latlng;
    const here = store.vehicle()?.state;
    const away = here?.lat ? `, ${map.distance([here.lat, here.lon], event.latlng).toFixed(0)} m from the vehicle` : "";
    element("cursor").textContent = `${lat.toFixed(6)}°, ${lng.toFixed(6)}°${away}`;
  });

  let asked = false;
  const addTiles = async () => {
    asked = true;
    const answer = await ask("/api/tiles");
    const layers = Object.fromEntries(Object.entries(answer.sets ?? {}).map(([name, [least, most]]) =>
      [name.replace(/[<>&]/g, "?"), L.tileLayer(`/tiles/${encodeURIComponent(name)}/{z}/{x}/{y}`, {
        minNativeZoom: least, maxNativeZoom: most, minZoom: Math.max(0, least - FARTHER), maxZoom: DEEPEST,
      })]));
    const [first] = Object.values(layers);
    first?.addTo(map);
    tiled = Boolean(first);
    drawContours();
    // Open, since the icon of a closed one is not served.
    if (first) L.control.layers({}, layers, { collapsed: false }).addTo(map);
  };

  // Contours of the bathymetry of the chosen vehicle's profile, where there are no tiles.
  const drawContours = async () => {
    const vehicle = store.chosen;
    if (!vehicle || contoured === vehicle || tiled) return;
    contoured = vehicle;
    const answer = await ask("/api/contours", { vehicle });
    if (vehicle !== store.chosen) return;
    contours.clearLayers();
    if (!answer.lines) setTimeout(() => { contoured = ""; drawContours(); }, RETRY);
    for (const { depth, places } of answer.lines ?? []) {
      L.polyline(places, { color: CONTOUR, weight: 1 }).addTo(contours).bindTooltip(make("span", `${depth} m`));
    }
  };

  const recenter = () => {
    drawContours();
    const here = store.vehicle()?.state;
    if (here?.lat !== undefined && here.lat !== null) map.panTo([here.lat, here.lon]);
  };
  return { draw: () => { if (!asked) addTiles(); draw(); }, resize: () => map.invalidateSize(), choose: recenter };
}

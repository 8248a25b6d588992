// A plan drawn on the map: points, survey areas with rows, loiters and stations, each with its own depth and speed.
import { element, make } from "./page.js";

const COLOR = "#c51b7d";
const KINDS = { goto: "Point", rows: "Survey area", loiter: "Loiter", station_keeping: "Station" };
const CORNERS = { rows: 3 }; // places of a shape; otherwise one
const MOST_ROWS = 500; // that are drawn

export function makePlanShapes(store) {
  const { L } = window, layer = store.map ? L.layerGroup().addTo(store.map) : null;
  const number = (name) => Number(element(`draw-${name}`).value);
  let shapes = [];
  let corners = []; // of a shape that is not finished

  element("draw-kind").replaceChildren(...Object.entries(KINDS).map(([kind, label]) => new Option(label, kind)));

  const drawMap = () => {
    if (!layer) return;
    layer.clearLayers();
    const line = shapes.flatMap((shape) => shape.kind === "rows" ? rowCorners(shape) : shape.places);
    if (line.length) L.polyline(line, { color: COLOR, weight: 2, interactive: false }).addTo(layer);
    for (const place of [...shapes.flatMap(({ places }) => places), ...corners]) {
      L.circleMarker(place, { radius: 4, color: COLOR }).addTo(layer);
    }
    for (const { kind, places, radius } of shapes) {
      if (kind === "loiter" || kind === "station_keeping") {
        L.circle(places[0], { radius, color: COLOR, weight: 1, fill: false, interactive: false }).addTo(layer);
      }
    }
  };

  const line = (shape, at) => {
    const item = make("li");
    const field = (name, label, step) => {
      const box = make("label", `${label} `);
      const input = make("input", "", { type: "number", step, value: shape[name] });
      input.onchange = () => { shape[name] = Number(input.value); drawMap(); };
      box.append(input);
      return box;
    };
    const remove = make("button", "Remove");
    remove.onclick = () => change(shapes.filter((each) => each !== shape));
    item.append(make("span", `${at + 1} ${KINDS[shape.kind]}`), field("z", `${shape.reference} (m)`, 0.5),
      field("speed", "speed (m/s)", 0.1), remove);
    return item;
  };

  const change = (made) => {
    shapes = made;
    corners = [];
    element("draw-points").value = String(shapes.length);
    element("drawn-list").replaceChildren(...shapes.map(line));
    element("draw-hint").textContent = "";
    drawMap();
  };

  store.addPoint = (lat, lon) => {
    const kind = element("draw-kind").value;
    corners.push([lat, lon]);
    if (corners.length < (CORNERS[kind] ?? 1)) {
      element("draw-hint").textContent = corners.length === 1
        ? "Press on the end of the first row." : "Press on the far side of the area.";
      drawMap();
      return;
    }
    const shape = { kind, places: corners, z: number("depth"), reference: element("draw-reference").value, speed: number("speed"),
      radius: number("radius"), seconds: number("seconds"), spacing: number("spacing") };
    change([...shapes, shape]);
  };

  const yaml = () => {
    const lines = shapes.map((shape) => {
      const [lat, lon] = shape.places[0];
      const words = [`lat: ${lat.toFixed(7)}°`, `lon: ${lon.toFixed(7)}°`, `${shape.reference}: ${shape.z}`,
        `speed: ${shape.speed} m/s`];
      if (shape.kind === "rows") {
        const { bearing, length, width, right } = rowsOf(shape);
        words.push(`bearing: ${(bearing * 180 / Math.PI).toFixed(2)}°`, `length: ${length.toFixed(1)}`, `width: ${width.toFixed(1)}`,
          `hstep: ${shape.spacing}`, "alternation: 100", `flags: [SQUARE_CURVE${right ? ", CURVE_RIGHT" : ""}]`);
      } else if (shape.kind !== "goto") words.push(`radius: ${shape.radius}`, `duration: ${shape.seconds}`);
      return `- ${shape.kind}: {${words.join(", ")}}`;
    });
    return `plan: ${JSON.stringify(element("draw-name").value)}\nmaneuvers:\n${lines.join("\n")}\n`;
  };

  element("draw-kind").onchange = () => change(shapes);
  const undo = () => { if (corners.length) { corners = []; change(shapes); } else change(shapes.slice(0, -1)); };
  return { yaml, undo, isEmpty: () => !shapes.length };
}

// Meters of a degree of latitude and longitude on the WGS-84 ellipsoid.
function scales(lat) {
  const angle = lat * Math.PI / 180;
  return [111132.95 - 559.85 * Math.cos(2 * angle), 111412.88 * Math.cos(angle) - 93.5 * Math.cos(3 * angle)];
}

function rowsOf({ places: [start, end, far] }) {
  const [north, east] = scales(start[0]);
  const [x, y] = [(end[0] - start[0]) * north, (end[1] - start[1]) * east];
  const [u, v] = [(far[0] - start[0]) * north, (far[1] - start[1]) * east];
  const length = Math.max(1, Math.hypot(x, y)), across = (x * v - y * u) / length;
  return { bearing: Math.atan2(y, x), length, width: Math.max(1, Math.abs(across)), right: across >= 0 };
}

// The rows as IMC's maneuver goes them, without its curves.
function rowCorners(shape) {
  const { bearing, length, width, right } = rowsOf(shape), [lat, lon] = shape.places[0], [north, east] = scales(lat);
  const step = Math.max(shape.spacing, width / MOST_ROWS, 0.1), found = [];
  for (let row = 0; row * step <= width + 1e-9; row += 1) {
    for (const along of row % 2 ? [length, 0] : [0, length]) {
      const across = row * step * (right ? 1 : -1);
      found.push([lat + (along * Math.cos(bearing) - across * Math.sin(bearing)) / north,
        lon + (along * Math.sin(bearing) + across * Math.cos(bearing)) / east]);
    }
  }
  return found;
}

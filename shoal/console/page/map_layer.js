// The map, and its layers of lines, dots and circles, some with text under the pointer.
import { make, page } from "./page.js";

export const { L } = window;
export const DEEPEST = 24; // zoom level
export const map = L?.map(page.map, { attributionControl: false, preferCanvas: true, minZoom: 0, maxZoom: DEEPEST }).setView([0, 0], 2);
let wanted = []; // places to show, once the map is seen

function fit() {
  if (!wanted.length || !page.map.clientHeight) return;
  map.fitBounds(L.latLngBounds(wanted).pad(0.3), { maxZoom: 19 });
  wanted = [];
}

export function makeLayer() {
  if (!map) return new Proxy({}, { get: () => () => {} });
  const group = L.layerGroup().addTo(map);
  const shape = (kind, basis) => (place, style, text) => {
    const made = L[kind](place, { interactive: Boolean(text), ...basis, ...style }).addTo(group);
    return text ? made.bindTooltip(make("span", text)) : made;
  };
  return {
    clear: () => group.clearLayers(),
    remove: () => group.remove(),
    line: shape("polyline", { weight: 2 }),
    area: shape("polygon", { weight: 2 }),
    dot: shape("circleMarker", { radius: 4 }),
    circle: shape("circle", { weight: 1 }),
    fit: (places) => { wanted = places; fit(); },
  };
}
if (map) { // also when texts above it need another line
  new ResizeObserver(() => { map.invalidateSize(); fit(); }).observe(page.map);
}

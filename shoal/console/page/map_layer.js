// The map, and its layers of lines, dots and circles, some with text under the pointer.
import { make, page } from "./page.js";

const { L } = window;
const DEEPEST = 24; // zoom level
const map = L?.map(page.map, { attributionControl: false, preferCanvas: true, minZoom: 0, maxZoom: DEEPEST }).setView([0, 0], 2);

function makeLayer() {
  if (!map) return { clear() {}, remove() {}, line() {}, area() {}, dot() {}, circle() {}, fit() {} };
  const group = L.layerGroup().addTo(map);
  const add = (kind, place, style, text) => {
    const shape = L[kind](place, { interactive: Boolean(text), ...style }).addTo(group);
    return text ? shape.bindTooltip(make("span", text)) : shape;
  };
  return {
    clear: () => group.clearLayers(),
    remove: () => group.remove(),
    line: (places, style, text) => add("polyline", places, { weight: 2, ...style }, text),
    area: (places, style, text) => add("polygon", places, { weight: 2, ...style }, text),
    dot: (place, style, text) => add("circleMarker", place, { radius: 4, ...style }, text),
    circle: (place, style, text) => add("circle", place, { weight: 1, ...style }, text),
    fit: (places) => { if (places.length) map.fitBounds(L.latLngBounds(places).pad(0.3), { maxZoom: 19 }); },
  };
}
export { L, DEEPEST, map, makeLayer };

// The entities of a vehicle, the worst first, with advice and lines of the log book.
import { cell, clock, duration, fill, make, page, row, small, store, write } from "./page.js";

const LINES = 2; // of the log book, for each entity

let shown = null;
let second = 0;
let times = []; // the cells of the durations; each has `since`

const evidence = (entity) => store.log
  .filter(([, vehicle, , , , label]) => vehicle === store.chosen && label === entity)
  .slice(-LINES).map(([time, , , , text]) => small(`${clock(time)} ${text}`));
function draw() {
  const vehicle = store.vehicle(), entities = vehicle?.health?.entities ?? [];
  const changed = entities !== shown;
  // Entities are sent when they change; their durations grow.
  if (!changed && second === Math.floor(store.now)) return;
  second = Math.floor(store.now);
  write(page.healthNote, vehicle && !vehicle.system?.there ? "LOST: this is as it was received last." : "", "bad");
  if (changed) {
    shown = entities;
    times = entities.map(({ since }) => make("td", "", { className: "whole", since }));
    fill(page.entities, entities.map(({ entity, state, text, advice }, at) => {
      const cause = advice ? [text, small(advice), ...evidence(entity)] : text;
      return row(entity, cell(state, `whole ${state}`), cause, times[at]);
    }));
  }
  for (const each of times) each.textContent = duration(Math.max(0, store.now - each.since));
}
export { draw, draw as choose };

// The entities of a vehicle, the worst first, with advice and lines of the log book.
import { cell, clock, duration, fill, page, row, small, store, write } from "./page.js";

const KINDS = { normal: "good", boot: "warn", fault: "warn", error: "bad", failure: "bad" };
const LINES = 2; // of the log book, for each entity

let shown = null;
let second = 0;
let times = []; // of each row: the cell of its duration, and since when

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
    times = entities.map(({ since }) => ({ at: cell("", "whole"), since }));
    fill(page.entities, entities.map(({ entity, state, text, advice }, at) => {
      const cause = advice ? [text, small(advice), ...evidence(entity)] : text;
      return row(entity, cell(state, `whole ${KINDS[state] ?? ""}`), cause, times[at].at);
    }));
  }
  for (const { at, since } of times) at.textContent = duration(Math.max(0, store.now - since));
}
export { draw, draw as choose };

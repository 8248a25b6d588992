// The entities of a vehicle, the worst first; those that are not in order with advice and their last lines in the log book.
import { clock, element, make } from "./page.js";

const KINDS = { normal: "good", boot: "warn", fault: "warn", error: "bad", failure: "bad" };

const LINES = 2; // of the log book, for each entity

export function makeHealth(store) {
  let shown = null;
  let second = 0;
  let times = []; // of each row: its cell of the duration, and since when

  const drawTimes = () => {
    for (const { cell, since } of times) cell.textContent = duration(store.now - since);
  };
  const evidence = (entity) => store.log
    .filter(([, vehicle, , , , label]) => vehicle === store.chosen && label === entity)
    .slice(-LINES).map(([time, , , , text]) => make("small", `${clock(time)} ${text}`));
  const draw = () => {
    const entities = store.vehicle()?.health?.entities ?? [];
    const changed = entities !== shown;
    // Entities are sent only when they change; their durations grow all the same.
    if (!changed && second === Math.floor(store.now)) return;
    second = Math.floor(store.now);
    if (changed) {
      shown = entities;
      times = entities.map(({ since }) => ({ cell: make("td"), since }));
      element("entities").replaceChildren(...entities.map((each, at) => {
        const row = make("tr");
        const cause = make("td", each.text);
        if (each.advice) cause.append(make("small", each.advice), ...evidence(each.entity));
        row.append(make("td", each.entity), make("td", each.state, { className: KINDS[each.state] ?? "" }),
          cause, times[at].cell);
        return row;
      }));
    }
    drawTimes();
  };
  return { draw, choose: draw };
}

function duration(given) {
  if (!Number.isFinite(given)) return "";
  const seconds = Math.max(0, given); // the time of a state is rounded, also up
  if (seconds < 90) return `${seconds.toFixed(0)} s`;
  return seconds < 5400 ? `${(seconds / 60).toFixed(0)} min` : `${(seconds / 3600).toFixed(1)} h`;
}

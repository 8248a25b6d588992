// The entities of a vehicle, the worst first.
import { element, make } from "./page.js";

const KINDS = { normal: "good", boot: "warn", fault: "warn", error: "bad", failure: "bad" };

export function makeHealth(store) {
  let shown = null;
  const draw = () => {
    const entities = store.vehicle()?.health?.entities ?? [];
    if (entities === shown) return;
    shown = entities;
    element("entities").replaceChildren(...entities.map((each) => {
      const row = make("tr");
      row.append(make("td", each.entity), make("td", each.state, { className: KINDS[each.state] ?? "" }),
        make("td", each.text), make("td", duration(store.vehicle().state?.time - each.since)));
      return row;
    }));
  };
  return { draw, choose: draw };
}

function duration(seconds) {
  if (!Number.isFinite(seconds) || seconds < 0) return "";
  if (seconds < 90) return `${seconds.toFixed(0)} s`;
  return seconds < 5400 ? `${(seconds / 60).toFixed(0)} min` : `${(seconds / 3600).toFixed(1)} h`;
}

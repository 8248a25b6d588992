// The log books of all vehicles, the newest entry first.
import { clock, element, make } from "./page.js";

const KINDS = { warning: "warn", error: "bad", critical: "bad" };

export function makeLog(store) {
  let dirty = true;
  const filter = element("log-filter");
  filter.oninput = () => { dirty = true; draw({ log: [] }); };
  const draw = (frame) => {
    dirty ||= frame.all || frame.log.length > 0;
    if (!dirty || element("log-view").hidden) return;
    dirty = false;
    const words = filter.value.toLowerCase();
    const lines = store.log.filter((entry) => entry.join(" ").toLowerCase().includes(words)).slice(-300).reverse();
    element("entries").replaceChildren(...lines.map(([time, vehicle, kind, context, text]) => {
      const row = make("tr");
      row.append(make("td", clock(time)), make("td", vehicle), make("td", context),
        make("td", text, { className: KINDS[kind] ?? "" }));
      return row;
    }));
  };
  return { draw, open: () => { dirty = true; draw({ log: [] }); } };
}

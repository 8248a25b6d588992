// Panels that a user has described in a file: values, plots, and buttons that are pressed twice.
import { ask, element, make, order, say } from "./page.js";
import { confirmed } from "./orders.js";

const OLD = 5000; // ms without a newer value

export function makePanels(store, show) {
  const view = element("panels-view"), tab = document.querySelector("[data-view=panels]");
  let panels = null; // null: not asked for yet
  let cells = []; // of the values that are shown: { path, digits, unit, cell, time, seen }
  let armed = [];

  store.panelFields = () => cells.map(({ path }) => path);

  const build = () => {
    const vehicle = store.chosen, mine = panels.filter((panel) => !panel.vehicle || panel.vehicle === vehicle);
    for (const disarm of armed) disarm();
    armed = [];
    cells = [];
    tab.hidden = !mine.length;
    view.replaceChildren(...mine.flatMap((panel) => [make("h2", panel.title), ...parts(vehicle, panel)]));
    store.sendFields();
  };

  const parts = (vehicle, { title, values, plots, buttons }) => {
    const table = make("table"), line = make("p", "", { className: "form panel-buttons" });
    table.append(...values.map(({ label, field, unit, digits }) => {
      const row = make("tr"), cell = make("td", "unknown");
      cells.push({ path: `${vehicle}/${field}`, digits, unit, cell, time: null, seen: 0 });
      row.append(make("td", label), cell);
      return row;
    }));
    const made = [table, line];
    for (const { label, order: name } of buttons) {
      const button = make("button", label);
      armed.push(confirmed(button, () => () => order(vehicle, name, { panel: title, button: label })));
      line.append(button);
    }
    if (plots.length) {
      const draw = make("button", "Plots");
      draw.onclick = () => { show("plots"); store.showPlots({ fields: plots, window: 0 }); };
      made.push(draw);
    }
    return made;
  };

  const read = async () => {
    panels = [];
    const answer = await ask("/api/panels");
    if (!answer.ok) { say(answer.text, "bad"); panels = null; return; }
    panels = answer.panels;
    build();
  };

  const draw = () => {
    if (panels === null) { read(); return; }
    for (const each of cells) {
      const [time, value] = store.values[each.path] ?? [];
      if (time !== undefined && time !== each.time) Object.assign(each, { time, seen: performance.now() });
      const old = each.time === null || !store.replay && performance.now() - each.seen > OLD;
      const text = time === undefined || value === null ? "unknown" : `${value.toFixed(each.digits)} ${each.unit}`;
      each.cell.textContent = each.time !== null && old ? `${text} (old)` : text;
      each.cell.className = old ? "warn" : "";
    }
  };
  return { draw, choose: () => { if (panels) build(); } };
}

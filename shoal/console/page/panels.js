// Panels of a user: values, plots, and buttons that are pressed twice.
import { ask, button, cell, failed, fill, make, order, page, row, store, untilDone, write } from "./page.js";
import { confirmed } from "./orders.js";
import { sendFields, showLayout } from "./plots.js";

const OLD = 5000; // ms without a newer value

const tab = (name) => document.querySelector(`[data-view=${name}]`);
let panels = null; // null: not known yet
let cells = []; // of the values that are shown: { path, digits, unit, shown, time, seen }

function build() {
  const vehicle = store.chosen, mine = (panels ?? []).filter((panel) => !panel.vehicle || panel.vehicle === vehicle);
  cells = [];
  tab("panels").hidden = !mine.length;
  fill(page.panelsView, mine.flatMap((panel) => parts(vehicle, panel)));
  store.panelFields = cells.map(({ path }) => path);
  sendFields();
}

function parts(vehicle, { title, values, plots, buttons }) {
  const rows = values.map(({ label, field, unit, digits }) => {
    const shown = cell("unknown");
    cells.push({ path: `${vehicle}/${field}`, digits, unit, shown, time: null, seen: 0 });
    return row(label, shown);
  });
  const line = buttons.map(({ label, order: name }) => {
    const pressed = button(label);
    confirmed(pressed, () => () => order(vehicle, name, { panel: title, button: label }));
    return pressed;
  });
  const made = [make("h2", title), make("table", rows), make("p", line, { className: "form panel-buttons" })];
  if (plots.length) made.push(button("Plots", () => { tab("plots").click(); showLayout({ fields: plots, window: 0 }); }));
  return made;
}

const read = untilDone(async () => {
  const answer = await ask("panels");
  if (failed(answer)) return false;
  panels = answer.panels;
  build();
  return true;
});

function draw() {
  read();
  for (const each of cells) {
    const [time, value] = store.values[each.path] ?? [];
    if (time !== undefined && time !== each.time) Object.assign(each, { time, seen: performance.now() });
    const isOld = each.time === null || !store.replay && performance.now() - each.seen > OLD;
    const text = time === undefined || value === null ? "unknown" : `${value.toFixed(each.digits)} ${each.unit}`;
    write(each.shown, each.time !== null && isOld ? `${text} (old)` : text, isOld ? "warn" : "");
  }
}
export { draw, build as choose };

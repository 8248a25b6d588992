// The parameters of an entity: read, set one by one, saved, and undone.
import { button, cell, failed, fill, fillOptions, isChosen, make, makeAsk, order, page, row, say, small, store, write } from "./page.js";

const PATIENCE = 20000; // ms: a vehicle may give no types

const select = page.entity, about = makeAsk();
let owner = ""; // the vehicle whose entities are listed

async function readEntities() {
  const answer = isChosen() ? await about("parameters") : null;
  if (failed(answer)) return;
  owner = store.chosen;
  fillOptions(select, answer.entities);
}

// First the values, which come at once, then all that is known of them.
async function readValues() {
  if (!owner || owner !== store.chosen) await readEntities();
  const vehicle = owner, entity = select.value;
  if (!vehicle || !entity) return;
  write(page.valuesNote, "");
  const answer = await about("parameters", { entity });
  if (!answer) return;
  if (failed(answer)) { fill(page.values); return; }
  const lines = new Map(Object.entries(answer.values).map(([name, value]) => [name, line(vehicle, entity, name, value)]));
  fill(page.values, [...lines.values()].map(({ shown }) => shown));
  const details = await about("parameter-details", { entity }, PATIENCE);
  if (!details) return;
  write(page.valuesNote, details.ok ? details.note : details.text);
  if (!details.ok) return;
  for (const [name, found] of Object.entries(details.values)) lines.get(name)?.describe(found);
  drawChanges(vehicle, details.changes);
}

async function change(vehicle, entity, name, words) {
  await order(vehicle, name, words);
  if (owner === vehicle && select.value === entity) await readValues();
}

function line(vehicle, entity, name, value) {
  const input = make("input", "", { value, ariaLabel: name, size: 12 });
  const set = button("Set", () => change(vehicle, entity, "set", { entity, parameter: name, value: input.value }));
  const [title, middle, last, place] = [name, input, set, ""].map((each) => cell(each));
  function describe(found) {
    title.append(...found.notes.map((text) => small(text)));
    middle.append(small(found.unit));
    input.disabled = set.disabled = found.editable === false;
    place.append(...found.origin.map(([text, kind]) => small(text, kind)));
    if (found.differs && !set.disabled) place.append(button("Value at the start", () => { input.value = found.file; input.focus(); }));
  }
  return { shown: row(title, middle, last, place), describe };
}

const drawChanges = (vehicle, changes) => fill(page.changes, changes.map(({ number, user, text, undone }) => {
  const undo = () => change(vehicle, select.value, "undo", { change: number });
  return make("li", [make("span", `${user}: ${text}${undone ? ` (undone by ${undone})` : ""}`),
    button("Undo", undo, { disabled: Boolean(undone) })]);
}));

page.entitiesRead.onclick = select.onchange = readValues;
page.valuesSave.onclick = async () => {
  const entity = select.value;
  if (owner && entity) await change(owner, entity, "save", { entity }); else say("read an entity first", "warn");
};
export function choose() {
  owner = "";
  fill(select);
  fill(page.values);
  fill(page.changes);
  write(page.valuesNote, "");
}
export const open = () => { if (store.chosen && owner !== store.chosen) readValues(); };

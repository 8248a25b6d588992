// The parameters of an entity, which are read when they are asked for, and set one by one.
import { ask, element, make, order, say } from "./page.js";

export function makeParameters(store) {
  const select = element("entity");
  let owner = "";

  const readEntities = async () => {
    owner = store.chosen;
    if (!owner) return;
    const answer = await ask("/api/parameters", { vehicle: owner });
    if (!answer.ok) { say(answer.text, "bad"); return; }
    select.replaceChildren(...answer.entities.map((name) => new Option(name)));
  };

  const readValues = async () => {
    const entity = select.value;
    const answer = await ask("/api/parameters", { vehicle: owner, entity });
    if (!answer.ok) { say(answer.text, "bad"); return; }
    element("values").replaceChildren(...Object.entries(answer.values).map(([name, value]) => row(entity, name, value)));
  };

  const row = (entity, name, value) => {
    const line = make("tr");
    const input = make("input", "", { value, ariaLabel: name });
    const set = make("button", "Set");
    set.onclick = async () => {
      await order(owner, "set", { entity, parameter: name, value: input.value });
      await readValues();
    };
    const cells = [make("td", name), make("td"), make("td")];
    cells[1].append(input);
    cells[2].append(set);
    line.append(...cells);
    return line;
  };

  element("entities-read").onclick = readValues;
  select.onchange = readValues;
  const forget = () => { owner = ""; select.replaceChildren(); element("values").replaceChildren(); };
  return { draw: () => {}, open: () => owner === store.chosen || readEntities(), choose: forget };
}

// The parameters of an entity, which are read when they are asked for, and set one by one.
import { ask, element, make, order, say } from "./page.js";

export function makeParameters(store) {
  const select = element("entity");
  let owner = ""; // the vehicle whose entities are listed
  let latest = 0; // number of the latest question: answers to those before it come too late

  const answerOf = async (words) => {
    const mine = ++latest;
    const answer = await ask("/api/parameters", words);
    if (mine !== latest) return null;
    if (answer.ok) return answer;
    say(answer.text, "bad");
    return null;
  };

  const readEntities = async () => {
    const vehicle = store.chosen;
    if (!vehicle) { say("no vehicle is chosen", "warn"); return; }
    const answer = await answerOf({ vehicle });
    if (!answer) return;
    owner = vehicle;
    select.replaceChildren(...answer.entities.map((name) => new Option(name)));
  };

  const readValues = async () => {
    if (!owner || owner !== store.chosen) await readEntities();
    const vehicle = owner, entity = select.value;
    if (!vehicle || !entity) return;
    const answer = await answerOf({ vehicle, entity });
    if (!answer) return;
    const rows = Object.entries(answer.values).map(([name, value]) => row(vehicle, entity, name, value));
    element("values").replaceChildren(...rows);
  };

  const row = (vehicle, entity, name, value) => {
    const line = make("tr");
    const input = make("input", "", { value, ariaLabel: name });
    const set = make("button", "Set");
    set.onclick = async () => {
      await order(vehicle, "set", { entity, parameter: name, value: input.value });
      if (owner === vehicle && select.value === entity) await readValues();
    };
    const cells = [make("td", name), make("td"), make("td")];
    cells[1].append(input);
    cells[2].append(set);
    line.append(...cells);
    return line;
  };

  element("entities-read").onclick = readValues;
  select.onchange = readValues;
  const forget = () => {
    latest += 1;
    owner = "";
    select.replaceChildren();
    element("values").replaceChildren();
  };
  const open = () => { if (store.chosen && owner !== store.chosen) readEntities(); };
  return { draw: () => {}, open, choose: forget };
}

// The parameters of an entity: read when they are asked for, set one by one, saved, and changes undone.
import { ask, element, make, order, say } from "./page.js";

const PATIENCE = 20000; // ms: a vehicle that gives no types is asked for them all the same

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

  // First the values, which come at once, then all that is known of them.
  const readValues = async () => {
    if (!owner || owner !== store.chosen) await readEntities();
    const vehicle = owner, entity = select.value;
    if (!vehicle || !entity) return;
    element("values-note").textContent = "";
    const answer = await answerOf({ vehicle, entity });
    if (!answer) { element("values").replaceChildren(); return; }
    const rows = new Map(Object.entries(answer.values).map(([name, value]) => [name, row(vehicle, entity, name, value)]));
    element("values").replaceChildren(...[...rows.values()].map(({ line }) => line));
    const mine = latest, details = await ask("/api/parameter-details", { vehicle, entity }, PATIENCE);
    if (mine !== latest) return;
    if (!details.ok) { element("values-note").textContent = details.text; return; }
    element("values-note").textContent = details.note;
    for (const [name, found] of Object.entries(details.values)) rows.get(name)?.describe(found);
    drawChanges(vehicle, details.changes);
  };

  const row = (vehicle, entity, name, value) => {
    const line = make("tr"), title = make("td", name), cell = make("td"), place = make("td"), last = make("td");
    const input = make("input", "", { value, ariaLabel: name, size: 12 }), set = make("button", "Set");
    set.onclick = async () => {
      await order(vehicle, "set", { entity, parameter: name, value: input.value });
      if (owner === vehicle && select.value === entity) await readValues();
    };
    const describe = (found) => {
      title.append(...notes(found).map((text) => make("small", text)));
      cell.append(make("small", found.unit));
      input.disabled = set.disabled = found.editable === false;
      if (found.editable === false) last.append(make("small", "only before the start"));
      if (found.file === null) return;
      const differs = !same(found.file, found.value);
      place.append(make("span", differs ? `differs: ${found.file || "(empty)"} in the file` : "as in the file",
        { className: differs ? "warn" : "" }), make("small", found.where));
      if (found.replaced.length) place.append(make("small", `instead of ${found.replaced.join(", ")}`));
      if (found.saved !== null) place.append(make("small", `saved for the next start: ${found.saved}`));
      if (!differs || found.editable === false) return;
      const back = make("button", "Value of the file");
      back.onclick = () => { input.value = found.file; input.focus(); };
      place.append(back);
    };
    cell.append(input);
    last.append(set);
    line.append(title, cell, last, place);
    return { line, describe };
  };

  const drawChanges = (vehicle, changes) => {
    element("changes").replaceChildren(...changes.map(({ number, user, text, undone }) => {
      const item = make("li"), undo = make("button", "Undo", { disabled: Boolean(undone) });
      undo.onclick = async () => {
        await order(vehicle, "undo", { change: number });
        if (owner === vehicle) await readValues();
      };
      item.append(make("span", `${user}: ${text}${undone ? ` (undone by ${undone})` : ""}`), undo);
      return item;
    }));
  };

  element("entities-read").onclick = readValues;
  element("values-save").onclick = async () => {
    const vehicle = owner, entity = select.value;
    if (!vehicle || !entity) { say("read an entity first", "warn"); return; }
    await order(vehicle, "save", { entity });
    if (owner === vehicle && select.value === entity) await readValues();
  };
  select.onchange = readValues;
  const forget = () => {
    latest += 1;
    owner = "";
    for (const name of ["entity", "values", "changes"]) element(name).replaceChildren();
    element("values-note").textContent = "";
  };
  const open = () => { if (store.chosen && owner !== store.chosen) readEntities(); };
  return { draw: () => {}, open, choose: forget };
}

function notes({ description, minimum, maximum, choices, default: usual, type }) {
  const range = [minimum === null ? "" : `at least ${minimum}`, maximum === null ? "" : `at most ${maximum}`];
  const parts = [type, range.filter(Boolean).join(", "), choices.length ? `one of ${choices.join(", ")}` : "",
    usual === null ? "" : `default ${usual || "(empty)"}`];
  return [description, parts.filter(Boolean).join("; ")].filter(Boolean);
}

// Whether two texts are the same value, such as `2, 3` and `2.0, 3.0`.
function same(text, other) {
  const words = [text, other].map((each) => each.split(",").map((word) => word.trim()));
  const equal = (word, at) => word === words[1][at] || word !== "" && Number(word) === Number(words[1][at]);
  return words[0].length === words[1].length && words[0].every(equal);
}

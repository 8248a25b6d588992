// Sets of plots by name, kept in this browser, and as a JSON file.
import { byName, element, say } from "./page.js";

const PLACE = "shoal-layouts";
const MOST = 50;
const LONGEST = 60, LONGEST_FIELD = 200; // characters
const LARGEST = 100000; // bytes of a file

// `get()` is the layout that is shown: { fields, window }; `set(layout)` shows another one.
export function makeLayouts({ get, set, most }) {
  const select = element("layouts");

  const checked = (given) => {
    const found = byName();
    for (const [name, layout] of Object.entries(given ?? {}).slice(0, MOST)) {
      const fields = layout?.fields;
      if (!name || name.length > LONGEST || !Array.isArray(fields)) continue;
      const kept = fields.filter((field) => typeof field === "string" && field.length <= LONGEST_FIELD).slice(0, most);
      found[name] = { fields: kept, window: Number.isFinite(layout.window) ? layout.window : 0 };
    }
    return found;
  };

  const read = () => {
    try { return checked(JSON.parse(localStorage.getItem(PLACE))); } catch { return byName(); }
  };

  const write = (layouts, chosen) => {
    if (Object.keys(layouts).length > MOST) { say(`at most ${MOST} layouts are kept: delete one first`, "warn"); return false; }
    try {
      localStorage.setItem(PLACE, JSON.stringify(layouts));
    } catch (error) {
      say(`the layout is not saved: ${error.message}`, "bad");
      return false;
    }
    drawList(chosen);
    return true;
  };

  const drawList = (chosen) => {
    select.replaceChildren(...Object.keys(read()).sort().map((name) => new Option(name)));
    if (chosen) select.value = chosen;
  };

  const download = (name, layouts) => {
    const address = URL.createObjectURL(new Blob([JSON.stringify(layouts, null, 1)], { type: "application/json" }));
    const link = Object.assign(document.createElement("a"), { href: address, download: name });
    link.click();
    URL.revokeObjectURL(address);
  };

  element("layout-save").onclick = () => {
    const name = element("layout-name").value.trim();
    if (!name) { say("write a name for the layout", "warn"); return; }
    if (write(byName(read(), { [name]: get() }), name)) say(`layout ${name} is saved in this browser`, "good");
  };
  element("layout-open").onclick = () => {
    const layout = read()[select.value];
    if (layout) set(layout); else say("choose a layout, or save one first", "warn");
  };
  element("layout-delete").onclick = () => {
    const layouts = read();
    delete layouts[select.value];
    write(layouts);
  };
  element("layout-export").onclick = () => download("shoal-layouts.json", read());
  element("layout-import").onchange = async (event) => {
    const [file] = event.target.files;
    if (!file) return;
    try {
      if (file.size > LARGEST) throw new Error(`it has more than ${LARGEST / 1000} kB`);
      const found = checked(JSON.parse(await file.text()));
      if (!Object.keys(found).length) throw new Error("there is no layout in it");
      if (write(byName(read(), found))) say(`layouts: ${Object.keys(found).join(", ")}`, "good");
    } catch (error) {
      say(`${file.name} is not imported: ${error.message}`, "bad");
    }
    event.target.value = "";
  };
  drawList();
}

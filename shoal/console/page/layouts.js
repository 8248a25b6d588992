// Sets of plots by name, kept in this browser, and as a JSON file.
import { byName, download, fillOptions, page, say } from "./page.js";
import { MOST as MOST_PLOTS, showLayout, shownLayout } from "./plots.js";

const PLACE = "shoal-layouts";
const MOST = 50;
const LONGEST = 60; // characters
const LARGEST = 100000; // bytes of a file

const select = page.layouts;

function checked(given) {
  const found = byName();
  for (const [name, layout] of Object.entries(given ?? {}).slice(0, MOST)) {
    const fields = layout?.fields;
    if (!name || name.length > LONGEST || !Array.isArray(fields)) continue;
    const kept = fields.filter((field) => typeof field === "string").slice(0, MOST_PLOTS);
    found[name] = { fields: kept, window: Number.isFinite(layout.window) ? layout.window : 0 };
  }
  return found;
}

function read() {
  try { return checked(JSON.parse(localStorage.getItem(PLACE))); } catch { return byName(); }
}

function drawList(chosen) {
  fillOptions(select, Object.keys(read()).sort());
  if (chosen) select.value = chosen;
}

function keep(layouts, chosen) {
  if (Object.keys(layouts).length > MOST) throw new Error(`at most ${MOST} are kept, delete one first`);
  localStorage.setItem(PLACE, JSON.stringify(layouts));
  drawList(chosen);
}

// Shows what has been done, or why it has not.
async function attempt(refusal, act) {
  try {
    say(await act(), "good");
  } catch (error) {
    say(`${refusal}: ${error.message}`, "bad");
  }
}

page.layoutSave.onclick = () => attempt("the layout is not saved", () => {
  const name = page.layoutName.value.trim();
  if (!name) throw new Error("write a name for it");
  keep(byName(read(), { [name]: shownLayout() }), name);
  return `layout ${name} is saved in this browser`;
});
page.layoutOpen.onclick = () => {
  const layout = read()[select.value];
  if (layout) showLayout(layout); else say("choose a layout, or save one first", "warn");
};
page.layoutDelete.onclick = () => attempt("the layout is not deleted", () => {
  const layouts = read(), name = select.value;
  delete layouts[name];
  keep(layouts);
  return `layout ${name} is deleted`;
});
page.layoutExport.onclick = () => download("shoal-layouts.json", JSON.stringify(read(), null, 1));
page.layoutImport.onchange = async ({ target }) => {
  const [file] = target.files;
  if (file) await attempt(`${file.name} is not imported`, async () => {
    if (file.size > LARGEST) throw new Error(`it has more than ${LARGEST / 1000} kB`);
    const found = checked(JSON.parse(await file.text()));
    if (!Object.keys(found).length) throw new Error("there is no layout in it");
    keep(byName(read(), found));
    return `layouts: ${Object.keys(found).join(", ")}`;
  });
  target.value = "";
};
drawList();

// Checks before a dive: each line with its color in words, and where it comes from.
import { cell, fill, fillOptions, makeLatest, page, post, row, small, store, write } from "./page.js";

const WORDS = { green: ["✓ in order", "good"], yellow: ["! look", "warn"], red: ["✗ not ready", "bad"] };
const OLD = 60000; // ms

const select = page.checkPlan, latest = makeLatest();
let checked = 0;
const tell = (text, kind) => write(page.checkResult, text, kind);

async function run() {
  const vehicle = store.chosen;
  if (!vehicle) return;
  tell("asking the vehicle");
  const answer = await latest(post("checks", { vehicle, plan: select.value }));
  if (!answer) return;
  checked = performance.now();
  const plan = select.value, rows = answer.checks ?? [];
  fillOptions(select, answer.plans ?? []);
  select.prepend(new Option("none", ""));
  select.value = plan;
  if (select.selectedIndex < 0) select.value = "";
  fill(page.checks, rows.map(({ name, color, value, source }) => {
    const [words, kind] = WORDS[color];
    return row(cell(words, `color ${kind}`), name, [value, small(source)]);
  }));
  const worst = ["red", "yellow"].find((color) => rows.some((row) => row.color === color)) ?? "green";
  tell(answer.text, answer.ok ? WORDS[worst][1] : "bad");
}

function draw() {
  if (!checked || store.replay || performance.now() - checked < OLD) return;
  checked = 0;
  tell(`${page.checkResult.textContent}; this is older than a minute: check again`, "warn");
}
function forget() {
  latest();
  checked = 0;
  fill(select);
  fill(page.checks);
  tell("");
}
page.checkRun.onclick = select.onchange = run;
export { draw, run as open, forget as choose };

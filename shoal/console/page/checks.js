// Checks before a dive: each line with its color in words, and where it comes from.
import { cell, fill, fillOptions, makeAsk, page, post, row, small, store, write } from "./page.js";

const WORDS = { green: "✓ in order", yellow: "! look", red: "✗ not ready" };
const OLD = 60000; // ms

const select = page.checkPlan, about = makeAsk(post);
let checked = 0;
const tell = (text, kind) => write(page.checkResult, text, kind);

async function run() {
  if (!store.chosen) return;
  tell("asking the vehicle");
  const answer = await about("checks", { plan: select.value });
  if (!answer) return;
  checked = performance.now();
  const plan = select.value, rows = answer.checks ?? [];
  fillOptions(select, [["none", ""], ...answer.plans ?? []]);
  select.value = plan;
  if (select.selectedIndex < 0) select.value = "";
  fill(page.checks, rows.map(({ name, color, value, source }) =>
    row(cell(WORDS[color], `color ${color}`), name, [value, small(source)])));
  const worst = ["red", "yellow"].find((color) => rows.some((row) => row.color === color)) ?? "green";
  tell(answer.text, answer.ok ? worst : "bad");
}

export function draw() {
  if (!checked || store.replay || performance.now() - checked < OLD) return;
  checked = 0;
  tell(`${page.checkResult.textContent}; this is older than a minute: check again`, "warn");
}
export function choose() {
  checked = 0;
  fill(select);
  fill(page.checks);
  tell("");
}
page.checkRun.onclick = select.onchange = run;
export { run as open };

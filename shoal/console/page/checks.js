// What a crew checks before a dive: each line with its color in words, and where it comes from.
import { ask, element, make } from "./page.js";

const WORDS = { green: ["✓ in order", "good"], yellow: ["! look", "warn"], red: ["✗ not ready", "bad"] };
const OLD = 60000; // ms
const PATIENCE = 20000; // ms: a vehicle may be slow to check a plan

export function makeChecks(store) {
  const select = element("check-plan");
  let latest = 0; // number of the latest question: answers to those before it come too late
  let checked = 0;

  const run = async () => {
    const vehicle = store.chosen, mine = ++latest, result = element("check-result");
    if (!vehicle) return;
    result.textContent = "asking the vehicle";
    result.className = "";
    const answer = await ask("/api/checks", { vehicle, plan: select.value }, PATIENCE);
    if (mine !== latest) return;
    checked = performance.now();
    const plan = select.value, rows = answer.checks ?? [];
    select.replaceChildren(new Option("none", ""), ...(answer.plans ?? []).map((name) => new Option(name)));
    select.value = plan;
    if (select.selectedIndex < 0) select.value = "";
    element("checks").replaceChildren(...rows.map(({ name, color, value, source }) => {
      const row = make("tr"), cell = make("td", value), [words, kind] = WORDS[color];
      cell.append(make("small", source));
      row.append(make("td", words, { className: `color ${kind}` }), make("td", name), cell);
      return row;
    }));
    const count = (color) => rows.filter((row) => row.color === color).length;
    const bad = count("red"), doubtful = count("yellow");
    result.className = !answer.ok || bad ? "bad" : doubtful ? "warn" : "good";
    const time = new Date((answer.time ?? 0) * 1000).toISOString().slice(11, 19);
    result.textContent = !answer.ok ? answer.text
      : `${bad || doubtful ? `NOT READY: ${bad} not ready, ${doubtful} to look at` : "READY"} (${time} UTC)`;
  };

  const draw = () => {
    if (!checked || store.replay || performance.now() - checked < OLD) return;
    checked = 0;
    element("check-result").className = "warn";
    element("check-result").textContent += "; this is older than a minute: check again";
  };
  const forget = () => {
    latest += 1;
    checked = 0;
    select.replaceChildren();
    element("checks").replaceChildren();
    element("check-result").textContent = "";
    if (!element("checks-view").hidden) run();
  };
  element("check-run").onclick = run;
  select.onchange = run;
  return { draw, open: run, choose: forget };
}

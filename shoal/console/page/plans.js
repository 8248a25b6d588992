// The plans of a vehicle: listed, shown, started and stopped; new ones drawn or written.
import { button, clock, download, failed, fill, isChosen, make, makeAsk, order, page, post, press, say, store, write } from "./page.js";
import { showPath } from "./map.js";
import { confirmed } from "./orders.js";
import { isEmpty, readText } from "./plan_shapes.js";

let owner = ""; // the vehicle whose plans are listed
let running = null; // the plan whose path has been asked for
let stored = null; // what the vehicle has reported last about its plans
const aboutList = makeAsk(), aboutOne = makeAsk(), aboutRunning = makeAsk(), text = page.planText;

async function refresh() {
  const answer = isChosen() ? await aboutList("plans") : null;
  if (failed(answer)) return;
  owner = store.chosen;
  fill(page.plans, answer.plans.map(({ name }) => line(owner, name)));
  if (!answer.plans.length) write(page.plans, "none is stored: draw one, or open a file");
}

function line(vehicle, plan) {
  async function show() {
    const answer = await aboutOne("plans", { plan });
    if (!failed(answer)) showPath(answer.path);
  }
  const act = (name, after) => async () => { await order(vehicle, name, { plan }); if (vehicle === store.chosen) await after(); };
  async function edit() {
    const answer = await aboutOne("plan-text", { plan });
    if (!failed(answer)) text.value = answer.text;
  }
  const remove = button("Delete", null, { className: "twice" });
  confirmed(remove, () => act("delete", refresh));
  return make("li", [make("span", plan), button("Show", show), button("Start", act("start", show)),
    button("Edit", edit), remove]);
}

// Whoever has started it: the map keeps its place.
async function showRunning() {
  const answer = store.replay ? null : await aboutRunning("plans", { plan: running });
  if (answer?.ok) showPath(answer.path, false);
}

export function draw() {
  const plan = store.vehicle()?.plan;
  if (!plan) return;
  // Somebody has changed a plan, here or in another program.
  if (plan.stored && plan.stored !== stored && owner === store.chosen) { if (stored) refresh(); stored = plan.stored; }
  if (plan.name !== running) { running = plan.name; if (running) showRunning(); }
  const eta = plan.eta ? `, ${plan.eta} s left, ends at ${clock(store.now + plan.eta)} UTC` : "";
  write(page.progress, plan.name ? `${plan.name}: ${plan.maneuver ?? "starting"}, ${plan.progress ?? 0} %${eta}`
    : `no plan is running; the last one: ${plan.outcome ?? "unknown"}`);
}

async function put(vehicle) {
  await order(vehicle, "put", { text: text.value });
  if (vehicle && vehicle === store.chosen) await refresh();
}

const sayDone = (words, remarks) => say([words, ...remarks].join("; "), remarks.length ? "warn" : "good");

page.drawToggle.onclick = ({ target }) => {
  store.drawing = !store.drawing;
  press(target, store.drawing, "Drawing", "Draw");
};
page.drawText.onclick = () => readText();
page.drawPut.onclick = async () => {
  const vehicle = store.chosen;
  if (isEmpty()) say("press on the map to add points first", "warn");
  else if (await readText()) await put(vehicle);
};
page.planPut.onclick = () => put(store.chosen);
page.planFile.onchange = async ({ target }) => {
  const [file] = target.files, vehicle = store.chosen;
  target.value = "";
  if (!file) return;
  const answer = await post("plan-import", { vehicle, name: file.name, text: await file.text() });
  if (failed(answer)) return;
  text.value = answer.text;
  sayDone(`${file.name} is read: see As text`, answer.remarks);
  showPath(answer.path);
};
page.planSave.onclick = async () => {
  const answer = await post("plan-export", { vehicle: store.chosen, suffix: page.planSuffix.value, text: text.value });
  if (failed(answer)) return;
  download(answer.name, answer.text);
  sayDone(`${answer.name} is saved`, answer.remarks);
};
page.plansRefresh.onclick = refresh;
for (const name of ["Stop", "Pause", "Resume"]) page[`plan${name}`].onclick = () => order(store.chosen, name.toLowerCase());
export function choose() {
  owner = "";
  stored = running = null;
  fill(page.plans);
  write(page.progress, "");
  showPath([]);
}
export const open = () => { if (store.chosen && owner !== store.chosen) refresh(); };

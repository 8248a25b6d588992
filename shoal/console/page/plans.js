// The plans of a vehicle: listed, drawn on the map, started and stopped; new ones drawn or written.
import { ask, element, make, order, post, say } from "./page.js";
import { makePlanShapes } from "./plan_shapes.js";

export function makePlans(store) {
  let owner = ""; // the vehicle whose plans are listed
  let latest = 0; // number of the latest list that was asked for: those before it come too late
  let running = null; // the plan whose path has been asked for
  let stored = null; // what the vehicle has reported last about its plans
  const shapes = makePlanShapes(store);
  store.drawing = false;

  const refresh = async () => {
    const vehicle = store.chosen;
    if (!vehicle) { say("no vehicle is chosen", "warn"); return; }
    const mine = ++latest;
    const answer = await ask("/api/plans", { vehicle });
    if (mine !== latest) return;
    if (!answer.ok) { say(answer.text, "bad"); return; }
    owner = vehicle;
    element("plans").replaceChildren(...answer.plans.map((plan) => line(vehicle, plan)));
  };

  const line = (vehicle, plan) => {
    const item = make("li");
    const show = make("button", "Show"), start = make("button", "Start"), remove = make("button", "Delete");
    show.onclick = async () => {
      const answer = await ask("/api/plans", { vehicle, plan: plan.name });
      if (vehicle !== store.chosen) return; // the map shows the plan of the chosen vehicle only
      if (answer.ok) store.showPath(answer.path); else say(answer.text, "bad");
    };
    start.onclick = async () => { await order(vehicle, "start", { plan: plan.name }); await show.onclick(); };
    remove.onclick = async () => {
      await order(vehicle, "delete", { plan: plan.name });
      if (vehicle === store.chosen) await refresh();
    };
    const edit = make("button", "Edit");
    edit.onclick = async () => {
      const answer = await ask("/api/plan-text", { vehicle, plan: plan.name });
      if (answer.ok) element("plan-text").value = answer.text; else say(answer.text, "bad");
    };
    item.append(make("span", plan.name), show, start, remove, edit);
    return item;
  };

  // Whoever has started it: the map keeps its place.
  const showRunning = async (vehicle, plan) => {
    if (store.replay) return;
    const answer = await ask("/api/plans", { vehicle, plan });
    if (answer.ok && vehicle === store.chosen && plan === running) store.showPath(answer.path, false);
  };

  const draw = () => {
    const plan = store.vehicle()?.plan;
    if (!plan) return;
    // Somebody has changed a plan, here or in another program.
    if (plan.stored && plan.stored !== stored && owner === store.chosen) { if (stored) refresh(); stored = plan.stored; }
    if (plan.name !== running) { running = plan.name; if (running) showRunning(store.chosen, running); }
    const eta = plan.eta ? `, ${plan.eta} s left, ends at ${clock(store.now + plan.eta)}` : "";
    element("progress").textContent = plan.name
      ? `${plan.name}: ${plan.maneuver ?? "starting"}, ${plan.progress ?? 0} %${eta}`
      : `no plan is running; the last one: ${plan.outcome ?? "unknown"}`;
  };

  const put = async (text) => {
    const vehicle = store.chosen;
    await order(vehicle, "put", { text });
    if (vehicle && vehicle === store.chosen) await refresh();
  };

  element("draw-toggle").onclick = (event) => {
    store.drawing = !store.drawing;
    event.target.setAttribute("aria-pressed", String(store.drawing));
    event.target.textContent = store.drawing ? "Drawing" : "Draw";
  };
  element("draw-undo").onclick = shapes.undo;
  element("draw-text").onclick = () => { element("plan-text").value = shapes.yaml(); };
  element("draw-put").onclick = async () => {
    if (shapes.isEmpty()) { say("press on the map to add points first", "warn"); return; }
    element("plan-text").value = shapes.yaml();
    await put(shapes.yaml());
  };
  element("plan-put").onclick = () => put(element("plan-text").value);
  element("plan-file").onchange = async ({ target }) => {
    const [file] = target.files;
    target.value = "";
    if (!file) return;
    const answer = await post("/api/plan-import", { vehicle: store.chosen, name: file.name, text: await file.text() });
    if (!answer.ok) { say(answer.text, "bad"); return; }
    element("plan-text").value = answer.text;
    say([`${file.name} is read: see As text`, ...answer.remarks].join("; "), answer.remarks.length ? "warn" : "good");
    store.showPath(answer.path);
  };
  element("plan-save").onclick = async () => {
    const suffix = element("plan-suffix").value;
    const answer = await post("/api/plan-export", { vehicle: store.chosen, suffix, text: element("plan-text").value });
    if (!answer.ok) { say(answer.text, "bad"); return; }
    const link = make("a", "", { href: URL.createObjectURL(new Blob([answer.text])), download: answer.name });
    link.click();
    URL.revokeObjectURL(link.href);
    say([`${answer.name} is saved`, ...answer.remarks].join("; "), answer.remarks.length ? "warn" : "good");
  };
  element("plans-refresh").onclick = refresh;
  for (const name of ["stop", "pause", "resume"]) element(`plan-${name}`).onclick = () => order(store.chosen, name);
  const forget = () => {
    latest += 1;
    owner = "";
    stored = running = null;
    element("plans").replaceChildren();
    element("progress").textContent = "";
    store.showPath?.([]);
  };
  const open = () => { if (store.chosen && owner !== store.chosen) refresh(); };
  return { draw, open, choose: forget };
}

const clock = (seconds) => new Date(seconds * 1000).toTimeString().slice(0, 5);

// The plans of a vehicle: listed, drawn on the map, started and stopped; new ones drawn or written.
import { ask, element, make, order, say } from "./page.js";

export function makePlans(store) {
  let owner = ""; // the vehicle whose plans are listed
  let latest = 0; // number of the latest list that was asked for: those before it come too late
  let points = [];
  store.drawing = false;
  store.drawn = points;

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
    item.append(make("span", plan.name), show, start, remove);
    return item;
  };

  const draw = () => {
    const plan = store.vehicle()?.plan;
    if (!plan) return;
    const eta = plan.eta ? `, ${plan.eta} s left` : "";
    element("progress").textContent = plan.name
      ? `${plan.name}: ${plan.maneuver ?? "starting"}, ${plan.progress ?? 0} %${eta}`
      : `no plan is running; the last one: ${plan.outcome ?? "unknown"}`;
  };

  const changePoints = (made) => {
    points = made;
    store.drawn = points;
    element("draw-points").value = String(points.length);
    store.showDrawn();
  };

  const yamlOfPoints = () => {
    const depth = Number(element("draw-depth").value), speed = Number(element("draw-speed").value);
    const lines = points.map(([lat, lon]) =>
      `- goto: {lat: ${lat.toFixed(7)}°, lon: ${lon.toFixed(7)}°, depth: ${depth}, speed: ${speed} m/s}`);
    return `plan: ${JSON.stringify(element("draw-name").value)}\nmaneuvers:\n${lines.join("\n")}\n`;
  };

  const put = async (text) => {
    const vehicle = store.chosen;
    await order(vehicle, "put", { text });
    if (vehicle && vehicle === store.chosen) await refresh();
  };

  store.addPoint = (lat, lon) => changePoints([...points, [lat, lon]]);
  element("draw-toggle").onclick = (event) => {
    store.drawing = !store.drawing;
    event.target.setAttribute("aria-pressed", String(store.drawing));
    event.target.textContent = store.drawing ? "Drawing" : "Draw";
  };
  element("draw-undo").onclick = () => changePoints(points.slice(0, -1));
  element("draw-text").onclick = () => { element("plan-text").value = yamlOfPoints(); };
  element("draw-put").onclick = async () => {
    if (!points.length) { say("press on the map to add points first", "warn"); return; }
    element("plan-text").value = yamlOfPoints();
    await put(yamlOfPoints());
  };
  element("plan-put").onclick = () => put(element("plan-text").value);
  element("plans-refresh").onclick = refresh;
  element("plan-stop").onclick = () => order(store.chosen, "stop");
  const forget = () => {
    latest += 1;
    owner = "";
    element("plans").replaceChildren();
    element("progress").textContent = "";
    store.showPath?.([]);
  };
  const open = () => { if (store.chosen && owner !== store.chosen) refresh(); };
  return { draw, open, choose: forget };
}

// Fields of any message over time, each in a plot of its own; all plots have one cursor.
import { ask, byName, element, make, say } from "./page.js";
import { makeLayouts } from "./layouts.js";

const LONGEST = 18000; // points: an hour
const MOST = 8;
const WHOLE = 120000; // ms to read a field of a whole log
const WINDOWS = [["10 s", 10], ["1 min", 60], ["10 min", 600], ["1 h", 3600], ["all", 0]]; // s

export function makePlots(store) {
  const traces = new Map(); // path: { times, values, plot, box, field }
  const windows = element("plot-window");
  let fields = null;
  windows.replaceChildren(...WINDOWS.map(([name, seconds]) => new Option(name, seconds)));
  windows.value = "0";

  store.panelFields ??= () => [];
  const sendFields = () => {
    if (store.socket?.readyState === WebSocket.OPEN) {
      store.socket.send(JSON.stringify({ fields: [...traces.keys(), ...store.panelFields()] }));
    }
  };

  // Whether the fields are known; an error is told, and asked anew the next time.
  const readFields = async () => {
    if (fields) return true;
    const answer = await ask("/api/fields");
    if (answer.ok === false) { say(answer.text, "bad"); return false; }
    fields = byName(answer);
    element("fields").replaceChildren(...Object.entries(fields).map(([name, unit]) => new Option(unit, name)));
    return true;
  };

  // Whether a field is drawn from now on; the reason why not is said.
  const add = async (field) => {
    const vehicle = store.chosen, path = `${vehicle}/${field}`, name = field.split(":")[0];
    if (!vehicle) { say("no vehicle is chosen", "warn"); return false; }
    if (!await readFields()) return false;
    if (!(name in fields)) { say(`there is no field "${name}": write it as Message.field`, "warn"); return false; }
    if (traces.has(path)) { say(`${path} is drawn already`, "warn"); return false; }
    if (traces.size >= MOST) { say(`at most ${MOST} fields are drawn: remove one first`, "warn"); return false; }
    const box = make("div");
    const unit = fields[name];
    const remove = make("button", `Remove ${path}`);
    remove.onclick = () => { drop(path); sendFields(); };
    box.append(remove);
    element("plots").append(box);
    const width = Math.max(240, element("plots").clientWidth - 10);
    const series = [{}, { label: `${path} ${unit && `(${unit})`}`, stroke: "#0b57a4", width: 1.5 }];
    const color = getComputedStyle(document.body).color;
    const axes = [{ stroke: color }, { stroke: color }];
    const scales = { x: { range: (_, least, most) => shownRange(least, most) } };
    const options = { width, height: 160, series, axes, scales, cursor: { sync: { key: "plots" } } };
    const plot = window.uPlot ? new window.uPlot(options, [[], []], box) : null;
    if (!plot) box.append(make("output"));
    const trace = { times: [], values: [], plot, box, field };
    traces.set(path, trace);
    if (store.replay) await readWhole(path, trace); else sendFields();
    return true;
  };

  const drop = (path) => {
    const { plot, box } = traces.get(path);
    plot?.destroy();
    box.remove();
    traces.delete(path);
  };

  // The times that a plot shows: the last ones, in a log those up to now.
  const shownRange = (least, most) => {
    const seconds = Number(windows.value);
    if (!seconds || !Number.isFinite(most)) return [least, most];
    const end = store.replay ? store.now : most;
    return [end - seconds, end];
  };

  // A log has the whole course of a field; the cursor stands at the present time.
  const readWhole = async (path, trace) => {
    const answer = await ask("/api/series", { path }, WHOLE);
    if (!answer.ok) { say(answer.text, "bad"); return; }
    Object.assign(trace, { times: answer.times, values: answer.values });
    trace.plot?.setData([trace.times, trace.values]);
  };

  const drawWhole = () => {
    const moves = windows.value !== "0" && !element("plots-view").hidden;
    for (const { times, values, plot, box } of traces.values()) {
      if (plot && moves && times.length) plot.setData([times, values]);
      if (plot) plot.setCursor({ left: plot.valToPos(store.now, "x"), top: 0 });
      else box.querySelector("output").textContent = ` ${values[times.findLastIndex((time) => time <= store.now)] ?? ""}`;
    }
  };

  const draw = () => {
    if (store.replay) { drawWhole(); return; }
    for (const [path, [time, value]] of Object.entries(store.values)) {
      const trace = traces.get(path);
      if (!trace || trace.times.at(-1) >= time) continue;
      trace.times.push(time);
      trace.values.push(value);
      if (trace.times.length > LONGEST) { trace.times.shift(); trace.values.shift(); }
      if (trace.plot && !element("plots-view").hidden) trace.plot.setData([trace.times, trace.values]);
      if (!trace.plot) trace.box.querySelector("output").textContent = ` ${value}`;
    }
  };

  store.sendFields = sendFields;
  const setLayout = store.showPlots = async ({ fields: wanted, window: seconds }) => {
    if (!store.chosen) { say("no vehicle is chosen", "warn"); return; }
    for (const path of [...traces.keys()]) drop(path);
    sendFields();
    windows.value = WINDOWS.some(([, each]) => each === seconds) ? String(seconds) : "0";
    say("");
    for (const field of wanted) await add(field);
  };

  makeLayouts({
    get: () => ({ fields: [...traces.values()].map(({ field }) => field), window: Number(windows.value) }),
    set: setLayout,
    most: MOST,
  });
  windows.onchange = () => { for (const { plot, times, values } of traces.values()) plot?.setData([times, values]); };
  element("field-add").onclick = () => add(element("field").value.trim());
  element("field").onkeydown = (event) => { if (event.key === "Enter") add(element("field").value.trim()); };
  return { draw, open: readFields, sendFields };
}

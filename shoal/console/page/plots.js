// Fields of any message over time, each in a plot of its own.
import { ask, byName, element, make, say } from "./page.js";

const LONGEST = 3000; // points
const MOST = 8;
const WHOLE = 120000; // ms to read a field of a whole log

export function makePlots(store) {
  const traces = new Map(); // path: { times, values, plot, box }
  let fields = null;

  const sendFields = () => {
    if (store.socket?.readyState === WebSocket.OPEN) {
      store.socket.send(JSON.stringify({ fields: [...traces.keys()] }));
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

  const add = async (field) => {
    const vehicle = store.chosen, path = `${vehicle}/${field}`, name = field.split(":")[0];
    if (!vehicle) { say("no vehicle is chosen", "warn"); return; }
    if (!await readFields()) return;
    if (!(name in fields)) { say(`there is no field "${name}": write it as Message.field`, "warn"); return; }
    if (traces.has(path)) { say(`${path} is drawn already`, "warn"); return; }
    if (traces.size >= MOST) { say(`at most ${MOST} fields are drawn: remove one first`, "warn"); return; }
    const box = make("div");
    const unit = fields[name];
    const remove = make("button", `Remove ${path}`);
    remove.onclick = () => { traces.delete(path); box.remove(); sendFields(); };
    box.append(remove);
    element("plots").append(box);
    const width = Math.max(240, element("plots").clientWidth - 10);
    const series = [{}, { label: `${path} ${unit && `(${unit})`}`, stroke: "#0b57a4", width: 1.5 }];
    const color = getComputedStyle(document.body).color;
    const axes = [{ stroke: color }, { stroke: color }];
    const plot = window.uPlot ? new window.uPlot({ width, height: 160, series, axes }, [[], []], box) : null;
    if (!plot) box.append(make("output"));
    const trace = { times: [], values: [], plot, box };
    traces.set(path, trace);
    if (store.replay) await readWhole(path, trace); else sendFields();
  };

  // A log has the whole course of a field; the cursor stands at the present time.
  const readWhole = async (path, trace) => {
    const answer = await ask("/api/series", { path }, WHOLE);
    if (!answer.ok) { say(answer.text, "bad"); return; }
    Object.assign(trace, { times: answer.times, values: answer.values });
    trace.plot?.setData([trace.times, trace.values]);
  };

  const drawWhole = () => {
    for (const { times, values, plot, box } of traces.values()) {
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

  element("field-add").onclick = () => add(element("field").value.trim());
  element("field").onkeydown = (event) => { if (event.key === "Enter") add(element("field").value.trim()); };
  return { draw, open: readFields, sendFields };
}

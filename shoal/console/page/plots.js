// Fields of any message over time, each in a plot of its own, with one cursor.
import { ask, button, byName, color, failed, fill, isChosen, make, page, say, store } from "./page.js";

const LONGEST = 18000; // points: an hour
export const MOST = 8;
const NARROWEST = 240; // px
const WHOLE = 120000; // ms to read a field of a whole log
const TIME = "{HH}:{mm}:{ss}";

const traces = new Map(); // path: { times, values, plot, box, output, field }
const windows = page.plotWindow, view = page.plotsView, chosen = page.field;
let fields = null;

export function sendFields() {
  if (store.socket?.readyState !== WebSocket.OPEN) return;
  store.socket.send(JSON.stringify({ fields: [...traces.keys(), ...store.panelFields] }));
}

// A plot of uPlot as wide as its place, which is only for it, or null where uPlot is not installed.
export function makePlot(place, series, data, options) {
  const { uPlot } = window, stroke = color("text"), width = () => Math.max(NARROWEST, place.clientWidth - 10);
  if (!uPlot) return null;
  const axes = [{ stroke, ...options.axis }, { stroke, size: 60 }];
  const plot = new uPlot({ width: width(), axes, series, ...options }, data, place);
  new ResizeObserver(() => {
    if (place.clientWidth && plot.width !== width()) plot.setSize({ width: width(), height: plot.height });
  }).observe(place);
  return plot;
}

// Whether the fields are known; after an error they are asked for anew.
async function readFields() {
  if (fields) return true;
  const answer = await ask("fields");
  if (failed(answer)) return false;
  fields = byName(answer);
  fill(page.fields, Object.entries(fields).map(([name, unit]) => new Option(unit, name)));
  return true;
}

// Draws a field from now on, or says why not.
async function add(field) {
  const vehicle = store.chosen, path = `${vehicle}/${field}`, name = field.split(":")[0];
  if (!isChosen(vehicle) || !await readFields()) return;
  const refusal = !(name in fields) ? `there is no field "${name}": write it as Message.field`
    : traces.has(path) ? `${path} is drawn already`
      : traces.size >= MOST ? `at most ${MOST} fields are drawn: remove one first` : "";
  if (refusal) return say(refusal, "warn");
  const unit = fields[name], output = make("span");
  const box = make("div", [button(`Remove ${path}`, () => { drop(path); sendFields(); }), output]);
  page.plots.append(box);
  const series = [{ label: "UTC", value: TIME }, { label: `${path} ${unit && `(${unit})`}`, stroke: color("link"), width: 1.5 }];
  const axis = { values: TIME, space: 70 }, scales = { x: { range: shownRange } };
  const tzDate = (time) => window.uPlot.tzDate(new Date(time * 1000), "Etc/UTC");
  const options = { height: 160, axis, scales, tzDate, cursor: { sync: { key: "plots" } } };
  const plot = makePlot(box, series, [[], []], options);
  const trace = { times: [], values: [], plot, box, output, field };
  traces.set(path, trace);
  if (store.replay) await readWhole(path, trace); else sendFields();
}

function drop(path) {
  const { plot, box } = traces.get(path);
  plot?.destroy();
  box.remove();
  traces.delete(path);
}

// The times that a plot shows: the last ones, in a log those up to now.
function shownRange(_, least, most) {
  const seconds = Number(windows.value);
  if (!seconds || !Number.isFinite(most)) return [least, most];
  const end = store.replay ? store.now : most;
  return [end - seconds, end];
}

function show({ times, values, plot, output }, value) {
  if (plot) plot.setData([times, values]); else output.textContent = ` ${value ?? ""}`;
}

// A log has the whole course of a field; the cursor stands at the present time.
async function readWhole(path, trace) {
  const answer = await ask("series", { path }, WHOLE);
  if (failed(answer) || traces.get(path) !== trace) return;
  Object.assign(trace, { times: answer.times, values: answer.values });
  show(trace);
}

function drawWhole() {
  const moves = windows.value !== "0" && !view.hidden;
  for (const trace of traces.values()) {
    const { times, values, plot } = trace;
    if (!plot || moves && times.length) show(trace, values[times.findLastIndex((time) => time <= store.now)]);
    plot?.setCursor({ left: plot.valToPos(store.now, "x"), top: 0 });
  }
}

function draw() {
  if (store.replay) return drawWhole();
  for (const [path, [time, value]] of Object.entries(store.values)) {
    const trace = traces.get(path);
    if (!trace || trace.times.at(-1) >= time) continue;
    const { times, values } = trace;
    times.push(time);
    values.push(value);
    if (times.length > LONGEST) { times.shift(); values.shift(); }
    if (!view.hidden) show(trace, value);
  }
}

// A layout: { fields, window }.
export const shownLayout = () => ({ fields: [...traces.values()].map(({ field }) => field), window: Number(windows.value) });

export async function showLayout({ fields: wanted, window: seconds }) {
  if (!isChosen(store.chosen)) return;
  for (const path of [...traces.keys()]) drop(path);
  sendFields();
  windows.value = seconds;
  if (windows.selectedIndex < 0) windows.value = "0";
  say("");
  for (const field of wanted) await add(field);
}

windows.onchange = () => { for (const trace of traces.values()) if (trace.plot) show(trace); };
page.fieldForm.onsubmit = () => add(chosen.value.trim());
export { draw, readFields as open };

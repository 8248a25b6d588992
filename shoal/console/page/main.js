// Logs in, receives frames, keeps the latest state of each vehicle, and redraws the views.
import { element, post, say } from "./page.js";
import { makeMap } from "./map.js";
import { makeHealth } from "./health.js";
import { makePlans } from "./plans.js";
import { makePlots } from "./plots.js";
import { makeLog } from "./log.js";
import { makeParameters } from "./parameters.js";
import { makeOrders } from "./orders.js";

const STALE = 3; // s without data
const store = { vehicles: {}, tracks: {}, log: [], values: {}, now: 0, chosen: "", socket: null };
store.vehicle = () => store.vehicles[store.chosen];
const views = {
  map: makeMap(store), health: makeHealth(store), plans: makePlans(store), plots: makePlots(store),
  log: makeLog(store), parameters: makeParameters(store),
};
makeOrders(store);
let received = performance.now();

async function logIn() {
  const token = location.hash.slice(1);
  if (!token) return;
  history.replaceState(null, "", "/");
  const answer = await post("/api/login", { token });
  if (!answer.ok) say(answer.text, "bad");
}

function connect() {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  const socket = new WebSocket(`${scheme}://${location.host}/frames`);
  store.socket = socket;
  socket.onopen = () => views.plots.sendFields();
  socket.onmessage = (event) => { received = performance.now(); take(JSON.parse(event.data)); };
  socket.onclose = (event) => {
    store.socket = null;
    if (event.reason === "log in first" || event.code === 1008 || event.code === 1006 && !received) {
      say("Log in: open the link that `shoal console` has printed.", "bad");
    }
    setTimeout(connect, 1000);
  };
}

function take(frame) {
  store.now = frame.now;
  if (frame.all) { store.vehicles = {}; store.tracks = frame.tracks; store.log = []; }
  for (const [name, sections] of Object.entries(frame.vehicles)) {
    store.vehicles[name] = { ...store.vehicles[name], ...sections };
    const state = sections.state;
    if (state && state.lat !== null && state.lat !== undefined && !frame.all) {
      const track = store.tracks[name] ??= [];
      track.push([state.lat, state.lon, state.depth]);
      if (track.length > 18000) track.splice(0, track.length - 18000);
    }
  }
  for (const name of frame.gone) delete store.vehicles[name];
  store.log.push(...frame.log);
  if (store.log.length > 1000) store.log.splice(0, store.log.length - 1000);
  store.values = frame.values;
  chooseVehicle();
  for (const view of Object.values(views)) view.draw(frame);
  summarize();
}

function chooseVehicle() {
  const names = Object.keys(store.vehicles).sort();
  const select = element("vehicle");
  if ([...select.options].map((option) => option.value).join() !== names.join()) {
    select.replaceChildren(...names.map((name) => new Option(store.vehicles[name].system?.name ?? name, name)));
  }
  if (!names.includes(store.chosen)) choose(names[0] ?? "");
  select.value = store.chosen;
}

function choose(name) {
  store.chosen = name;
  for (const view of Object.values(views)) view.choose?.();
}

function summarize() {
  const vehicle = store.vehicle();
  const summary = element("summary");
  if (!vehicle) { summary.textContent = "no vehicle on the network"; return; }
  const { system, state, plan } = vehicle;
  const age = state.time === undefined ? null : store.now - state.time;
  const parts = [plan.mode ?? "mode unknown"];
  if (plan.name) parts.push(`${plan.name}${plan.progress === null ? "" : ` ${plan.progress.toFixed(0)} %`}`);
  if (state.depth !== undefined && state.depth !== null) parts.push(`depth ${state.depth.toFixed(1)} m`);
  if (state.speed !== undefined && state.speed !== null) parts.push(`${state.speed.toFixed(1)} m/s`);
  if (system.battery !== null) parts.push(`battery ${system.battery.toFixed(0)} %`);
  if (plan.motors) parts.push(`motors ${plan.motors}`);
  if (!system.there) parts.push("LOST");
  else if (age !== null && age > STALE) parts.push(`position ${age.toFixed(0)} s old`);
  if (system.conflict) parts.push(system.conflict);
  summary.textContent = parts.join(" · ");
  summary.className = !system.there || plan.mode === "error" ? "bad" : "";
}

function checkAge() {
  const silent = (performance.now() - received) / 1000;
  document.body.classList.toggle("stale", silent > STALE);
  if (silent > STALE) element("summary").textContent = `no data for ${silent.toFixed(0)} s`;
}

for (const tab of document.querySelectorAll("[role=tab]")) tab.onclick = () => show(tab.dataset.view);

function show(view) {
  for (const tab of document.querySelectorAll("[role=tab]")) {
    tab.setAttribute("aria-selected", String(tab.dataset.view === view));
  }
  document.body.classList.toggle("on-map", view === "map");
  const side = view === "map" ? "health" : view;
  for (const section of document.querySelectorAll("main > section:not([data-wide])")) {
    section.hidden = section.id !== `${side}-view` || view === "map" && innerWidth <= 800;
  }
  views[side].open?.();
  views.map.resize();
}

element("vehicle").onchange = (event) => choose(event.target.value);
setInterval(checkAge, 500);
show("map");
await logIn();
connect();

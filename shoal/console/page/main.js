// Logs in, receives frames, keeps the latest state of each vehicle, and redraws the views.
import { byName, element, say } from "./page.js";
import { makeAccount } from "./account.js";
import { makeAlarms } from "./alarms.js";
import { makeChecks } from "./checks.js";
import { makeMap } from "./map.js";
import { makeHealth } from "./health.js";
import { makePlans } from "./plans.js";
import { makePlots } from "./plots.js";
import { makeLog } from "./log.js";
import { makeLogs } from "./logs.js";
import { makePanels } from "./panels.js";
import { makeRates } from "./rates.js";
import { makeParameters } from "./parameters.js";
import { makeOrders } from "./orders.js";
import { makeFlight } from "./flight.js";
import { makeCameras } from "./cameras.js";
import { makeForecast } from "./forecast.js";
import { makeMapExtras } from "./map_extras.js";
import { makeReplay } from "./replay.js";
import { makeSteer } from "./steer.js";
import { extendTrack, tracksOf } from "./tracks.js";

const STALE = 3; // s without data
// Exported for tests. `byUser`: whether the operator, not this page, has chosen the vehicle.
export const store = {
  vehicles: byName(), tracks: byName(), log: [], values: byName(), leases: byName(), now: 0, chosen: "", byUser: false, socket: null,
};
const labels = byName(); // displayable names, also of vehicles that are no longer known
store.vehicle = () => store.vehicles[store.chosen];
const views = {
  map: makeMap(store), health: makeHealth(store), plans: makePlans(store), plots: makePlots(store),
  log: makeLog(store), parameters: makeParameters(store), account: makeAccount(store),
  replay: makeReplay(store), flight: makeFlight(store), alarms: makeAlarms(store), checks: makeChecks(store),
  logs: makeLogs(store), rates: makeRates(store), cameras: makeCameras(store), steer: makeSteer(store),
  forecast: makeForecast(store), extras: makeMapExtras(store), panels: makePanels(store, (view) => show(view)),
};
const orders = makeOrders(store);
let received = performance.now();
let listed = ""; // the options of the list of vehicles

function connect() {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  const socket = new WebSocket(`${scheme}://${location.host}/frames`);
  store.socket = socket;
  socket.onopen = () => {
    views.plots.sendFields();
  };
  socket.onmessage = (event) => receive(event.data);
  socket.onclose = () => {
    store.socket = null;
    setTimeout(connectIfLoggedIn, 1000);
  };
}

async function connectIfLoggedIn() {
  if (await views.account.recall()) connect(); else setTimeout(connectIfLoggedIn, 1000);
}

// Also for tests, which give it frames of their own. A frame that fails is none: the age of the data goes on.
export function receive(text) {
  try {
    take(JSON.parse(text));
    received = performance.now();
  } catch (error) {
    say(`this page has failed: ${error.message}`, "bad");
    console.warn(error);
  }
}

function take(frame) {
  store.now = frame.now;
  store.replay = frame.replay ?? null;
  if (frame.tracks) store.tracks = tracksOf(frame.tracks);
  if (frame.all) { store.vehicles = byName(); store.log = []; }
  for (const [name, sections] of Object.entries(frame.vehicles)) {
    store.vehicles[name] = { ...store.vehicles[name], ...sections };
    if (!frame.tracks && !frame.replay) extendTrack(store.tracks, name, sections.state, frame.now);
  }
  for (const name of frame.gone) delete store.vehicles[name];
  store.log.push(...frame.log);
  if (store.log.length > 1000) store.log.splice(0, store.log.length - 1000);
  store.values = byName(frame.values);
  store.leases = byName(frame.leases);
  chooseVehicle();
  for (const view of Object.values(views)) view.draw(frame);
  summarize();
}

function chooseVehicle() {
  const names = Object.keys(store.vehicles).sort();
  for (const name of names) labels[name] = store.vehicles[name].system?.name ?? name;
  // Orders must not go to another vehicle because one has dropped out: the choice of the operator stays.
  if (!names.includes(store.chosen) && !store.byUser && names.length) {
    if (store.chosen) say(`${labels[store.chosen]} is gone: ${labels[names[0]]} is chosen now`, "warn");
    choose(names[0]);
  }
  const options = names.map((name) => [labels[name], name]);
  if (store.chosen && !names.includes(store.chosen)) options.unshift([`${labels[store.chosen]} (LOST)`, store.chosen]);
  const select = element("vehicle");
  if (listed !== JSON.stringify(options)) { // an open list would close
    listed = JSON.stringify(options);
    select.replaceChildren(...options.map(([label, name]) => new Option(label, name)));
  }
  select.value = store.chosen;
}

function choose(name) {
  store.chosen = name;
  orders.disarm();
  for (const view of Object.values(views)) view.choose?.();
}

function summarize() {
  const vehicle = store.vehicle();
  const summary = element("summary");
  if (!vehicle) {
    summary.textContent = store.chosen ? `${labels[store.chosen]}: LOST` : "no vehicle on the network";
    summary.className = store.chosen ? "bad" : "";
    return;
  }
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
  views.alarms.checkSilence(silent > STALE);
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

element("vehicle").onchange = (event) => {
  store.byUser = true;
  choose(event.target.value);
  summarize();
};
setInterval(checkAge, 500);
show("map");
await views.account.byLink();
await connectIfLoggedIn();

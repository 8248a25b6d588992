// Logs in, receives frames, and draws the views.
import { ageOf, byName, clock, fillOptions, openSocket, page, say, STALE, store, write } from "./page.js";
import * as account from "./account.js";
import * as alarms from "./alarms.js";
import { sendFields } from "./plots.js";
import { extendTrack, tracksOf } from "./tracks.js";

const SILENT = 10; // s without data, until the page connects anew: a dead connection may have no end
export { store }; // for tests
// Modules of index.html. Each may have `draw` for a frame, `choose` after a choice, `open` when it comes into view.
const views = {};
for (const { href, dataset } of document.querySelectorAll("link[data-module]")) views[dataset.module] = await import(href);
const labels = byName(); // displayable names, also of lost vehicles
const tabs = document.querySelectorAll("[role=tab]");
let received = performance.now(), opened = received;
let listed = ""; // the options of the list of vehicles
let side = "health"; // the view beside the map

function connect() {
  const socket = openSocket("frames");
  store.socket = socket;
  opened = performance.now();
  socket.onopen = sendFields;
  socket.onmessage = ({ data }) => receive(data);
  socket.onclose = () => {
    if (store.socket !== socket) return;
    store.socket = null;
    setTimeout(connectIfLoggedIn, 1000);
  };
}

async function connectIfLoggedIn() {
  if (await account.recall()) connect(); else setTimeout(connectIfLoggedIn, 1000);
}

// A frame that fails is none: the age of the data goes on.
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
  store.log.splice(0, store.log.length - 1000);
  store.values = byName(frame.values);
  store.leases = byName(frame.leases);
  chooseVehicle();
  for (const view of Object.values(views)) view.draw?.(frame);
  summarize();
}

function chooseVehicle() {
  const names = Object.keys(store.vehicles).sort();
  for (const name of names) labels[name] = store.vehicles[name].system?.name ?? name;
  // Orders must not go to another vehicle because one has dropped out: the choice of the operator stays.
  const owner = store.replay?.owner; // a log also has other systems
  const first = [owner, store.chosen].find((name) => names.includes(name)) ?? names[0];
  if (first !== store.chosen && !store.byUser && names.length) {
    if (store.chosen && !owner) say(`${labels[store.chosen]} is gone: ${labels[first]} is chosen now`, "warn");
    choose(first);
  }
  const options = names.map((name) => [labels[name], name]);
  if (store.chosen && !names.includes(store.chosen)) options.unshift([`${labels[store.chosen]} (LOST)`, store.chosen]);
  if (listed !== JSON.stringify(options)) { // an open list would close
    listed = JSON.stringify(options);
    fillOptions(page.vehicle, options);
  }
  page.vehicle.value = store.chosen;
}

function choose(name) {
  store.chosen = name;
  for (const view of Object.values(views)) view.choose?.();
  views[side].open?.();
}

function summarize() {
  write(page.clock, `${clock(store.now)} UTC`);
  const vehicle = store.vehicle(), { chosen } = store;
  if (!vehicle) {
    const text = chosen ? `${labels[chosen]}: LOST` : "no vehicle on the network";
    write(page.summary, text, chosen ? "bad" : "");
    write(page.heard, text);
    return;
  }
  const { system, state, plan } = vehicle, age = ageOf(state);
  const number = (name, value, digits, unit) => Number.isFinite(value) ? `${name}${value.toFixed(digits)}${unit}` : "";
  const parts = [ // what is shown, and heard by a screen reader when it changes: no numbers
    [plan.mode ?? "mode unknown"],
    [plan.name && plan.name + number(" ", plan.progress, 0, " %"), plan.name],
    [number("depth ", state.depth, 1, " m"), ""],
    [number("", state.speed, 1, " m/s"), ""],
    [number("battery ", system.battery, 0, " %"), ""],
    [plan.motors && `motors ${plan.motors}`],
    system.there ? age > STALE ? [number("position ", age, 0, " s old"), "position old"] : [] : ["LOST"],
    [system.conflict],
  ];
  write(page.heard, [labels[chosen], ...parts.map(([shown, heard = shown]) => heard)].filter(Boolean).join(", "));
  const kind = !system.there || plan.mode === "error" ? "bad" : age > STALE ? "warn" : "";
  write(page.summary, parts.map(([shown]) => shown).filter(Boolean).join(" · "), kind);
}

function checkAge() {
  const silent = (performance.now() - received) / 1000;
  document.body.classList.toggle("stale", silent > STALE);
  alarms.checkSilence(silent > STALE);
  if (silent > STALE) write(page.summary, `no data for ${silent.toFixed(0)} s`, "bad");
  if (silent > SILENT && store.socket && performance.now() - opened > SILENT * 1000) {
    const dead = store.socket;
    store.socket = dead.onmessage = null;
    dead.close();
    connectIfLoggedIn();
  }
}

function show(view) {
  for (const tab of tabs) tab.setAttribute("aria-selected", String(tab.dataset.view === view));
  document.body.classList.toggle("on-map", view === "map");
  side = view === "map" ? "health" : view;
  for (const section of document.querySelectorAll("main > section:not([data-wide])")) section.hidden = section.id !== `${side}-view`;
  views[side].open?.();
}

for (const tab of tabs) tab.onclick = () => show(tab.dataset.view);
page.vehicle.onchange = ({ target }) => {
  store.byUser = true;
  choose(target.value);
  summarize();
};
document.onsubmit = (event) => event.preventDefault(); // forms load nothing
setInterval(checkAge, 500);
// A link that is pasted into an open tab changes only what follows `#`, which loads nothing.
window.onhashchange = () => { if (location.hash) location.reload(); };
show("map");
await account.byLink();
await connectIfLoggedIn();

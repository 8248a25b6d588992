// What is known of the vehicles, and small tools of the page. Text from the network becomes text, never markup.
const PATIENCE = 8000; // ms; an Abort must not wait for one of the six connections of a browser
const RETRY = 5000; // ms

export const STALE = 3; // s without data

// An object by names of the network, any of which may be `constructor` or `__proto__`: it inherits nothing.
export const byName = (...from) => Object.assign(Object.create(null), ...from);

// `byUser`: whether the operator, not this page, has chosen the vehicle.
export const store = {
  vehicles: byName(), tracks: byName(), log: [], values: byName(), leases: byName(), panelFields: [],
  now: 0, replay: null, chosen: "", byUser: false, socket: null, drawing: false, measuring: false,
  vehicle: () => store.vehicles[store.chosen],
};

// s since a position was received
export const ageOf = (state) => Number.isFinite(state?.time) ? store.now - state.time : 0;
export const isOld = ({ system, state }) => !system?.there || ageOf(state) > STALE;
export function placeOf(state) {
  const place = [state?.lat, state?.lon];
  return place.every(Number.isFinite) ? place : null;
}

// The elements that have an id: `page.planText` is `plan-text`.
export const page = new Proxy({}, {
  get: (_, name) => document.getElementById(name.replace(/[A-Z]/g, (each) => `-${each.toLowerCase()}`)),
});

// `content` is a text or an element, or a list of them.
export function make(tag, content = "", properties = {}) {
  const made = document.createElement(tag);
  made.append(...[content].flat());
  return Object.assign(made, properties);
}

export const button = (text, onclick, properties) => make("button", text, { onclick, ...properties });
export const small = (text, className = "") => make("small", text, { className });

export const cell = (content, className = "") => make("td", content, { className });

// A row of a table: its cells, or what is in them.
export const row = (...cells) => make("tr", cells.map((each) => each.tagName === "TD" ? each : cell(each)));

export const fill = (place, items = []) => place.replaceChildren(...items);
// Each option is its text, or text and value.
export const fillOptions = (place, options) => fill(place, options.map((each) => new Option(...[each].flat())));

// A text that stays is left alone: a screen reader would read it again.
export function write(place, text, kind = "") {
  if (place.textContent !== text) place.textContent = text;
  place.className = kind;
}

export const say = (text, kind) => write(page.result, text, kind);
export const writeAnswer = (place, answer) => write(place, answer.text, answer.ok ? "good" : "bad");

// Shows a button as pressed or not, with a text for each.
export function press(pressed, isPressed, on = pressed.textContent, off = on) {
  pressed.setAttribute("aria-pressed", String(Boolean(isPressed)));
  pressed.textContent = isPressed ? on : off;
}

// Whether the words in a field of the page are in some texts.
export const matches = ({ value }, ...texts) => texts.join(" ").toLowerCase().includes(value.toLowerCase());

async function request(path, options, patience) {
  try {
    const response = await fetch(path, options);
    const text = await response.text();
    return response.ok ? JSON.parse(text) : { ok: false, text };
  } catch (error) {
    const reason = error.name === "TimeoutError" ? `none within ${patience / 1000} s` : error.message;
    return { ok: false, text: `no answer of the console: ${reason}` };
  }
}

export const post = (path, body = {}) =>
  request(`/api/${path}`, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });

export const ask = (path, words = {}, patience = PATIENCE) =>
  request(`/api/${path}?${new URLSearchParams(words)}`, { signal: AbortSignal.timeout(patience) }, patience);

// Whether an answer is none, or an error, which is shown.
export function failed(answer) {
  if (answer?.ok === false) say(answer.text, "bad");
  return !answer || answer.ok === false;
}

export function isChosen(vehicle = store.chosen) {
  if (!vehicle) say("no vehicle is chosen", "warn");
  return Boolean(vehicle);
}

// Asks about the chosen vehicle. The answer is null if there is none, or another question or vehicle came meanwhile.
export function makeAsk(send = ask) {
  let latest = 0;
  return async (path, words, patience) => {
    const mine = ++latest, vehicle = store.chosen;
    const answer = vehicle ? await send(path, { vehicle, ...words }, patience) : null;
    return mine === latest && vehicle === store.chosen ? answer : null;
  };
}

// The answer to an order that takes long: its button rests meanwhile, and what is shown can cancel it.
export async function postJob(path, words, pressed, shown) {
  const turn = (isBusy) => { pressed.disabled = isBusy; shown.hidden = !isBusy; };
  turn(true);
  shown.scrollIntoView({ block: "nearest" });
  const answer = await post(path, words);
  turn(false);
  return answer;
}

export const openSocket = (path) => new WebSocket(`${location.origin.replace("http", "ws")}/${path}`);

// Acts again and again while the page is seen, with `pause()` ms in between, also if the act fails.
export async function repeat(act, pause) {
  try {
    if (!document.hidden) await act();
  } catch (error) {
    console.warn(error);
  }
  setTimeout(repeat, pause(), act, pause);
}

// A function that acts when it is called, after a pause again, until the act has succeeded.
export function untilDone(act) {
  let next = 0;
  return async () => {
    if (performance.now() < next) return;
    next = Infinity;
    if (!await act()) next = performance.now() + RETRY;
  };
}

// An abort after which motors turn is obeyed, but not at its end.
export const kindOf = ({ ok, text }) => !ok ? "bad" : text.startsWith("aborted") ? "warn" : "good";
export const told = (vehicle, answer) => `${vehicle}: ${answer.ok ? "" : "NOT OBEYED: "}${answer.text}`;

export async function order(vehicle, name, words = {}) {
  if (!isChosen(vehicle)) return;
  say(`${name}: sent to ${vehicle}`);
  const answer = await post("order", { vehicle, order: name, ...words });
  say(told(vehicle, answer), kindOf(answer));
}

// ISO 8601. A vehicle may send any number as time, also one that is no date.
export function utc(time) {
  const date = new Date(Number.isFinite(time) ? time * 1000 : NaN);
  return Number.isNaN(date.getTime()) ? "" : date.toISOString();
}
export const clock = (time) => utc(time).split("T")[1]?.slice(0, 8) ?? "?";

export const duration = (seconds) => `${String(Math.floor(seconds / 3600)).padStart(2, "0")}${clock(seconds).slice(2)}`;

export const color = (name) => getComputedStyle(document.body).getPropertyValue(`--${name}`);

export function download(name, content) {
  const href = URL.createObjectURL(new Blob([content]));
  make("a", "", { href, download: name }).click();
  URL.revokeObjectURL(href);
}

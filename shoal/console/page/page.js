// Small tools of the page. Text from the network becomes text, never markup.
const PATIENCE = 8000; // ms; a browser has six connections, which questions must not hold while an Abort waits
export const element = (id) => document.getElementById(id);

export function make(tag, text = "", properties = {}) {
  const made = document.createElement(tag);
  made.textContent = text;
  return Object.assign(made, properties);
}

// An object by names of the network, any of which may be `constructor` or `__proto__`: it inherits nothing.
export const byName = (...from) => Object.assign(Object.create(null), ...from);

export function say(text, kind = "") {
  const result = element("result");
  result.textContent = text;
  result.className = kind;
}

async function read(response) {
  const text = await response.text();
  if (response.ok) return JSON.parse(text);
  return { ok: false, text };
}

export async function post(path, body) {
  try {
    const headers = { "Content-Type": "application/json" };
    return await read(await fetch(path, { method: "POST", headers, body: JSON.stringify(body) }));
  } catch (error) {
    return { ok: false, text: `no answer of the console: ${error.message}` };
  }
}

export async function ask(path, words = {}, patience = PATIENCE) {
  try {
    return await read(await fetch(`${path}?${new URLSearchParams(words)}`, { signal: AbortSignal.timeout(patience) }));
  } catch (error) {
    const reason = error.name === "TimeoutError" ? `none within ${patience / 1000} s` : error.message;
    return { ok: false, text: `no answer of the console: ${reason}` };
  }
}

// An abort after which motors turn is obeyed, but not yet what the operator wants to see.
export function kindOf(answer) {
  if (!answer.ok) return "bad";
  return answer.text.startsWith("aborted") ? "warn" : "good";
}

export const told = (vehicle, answer) => `${vehicle}: ${answer.ok ? "" : "NOT OBEYED: "}${answer.text}`;

export async function order(vehicle, name, words = {}) {
  if (!vehicle) {
    say("no vehicle is chosen", "warn");
    return { ok: false, text: "no vehicle is chosen" };
  }
  say(`${name}: sent to ${vehicle}`);
  const answer = await post("/api/order", { vehicle, order: name, ...words });
  say(told(vehicle, answer), kindOf(answer));
  return answer;
}

// A vehicle sends any number as time; one that is no date must not end the page.
export function clock(time) {
  const date = new Date(Number.isFinite(time) ? time * 1000 : NaN);
  return Number.isNaN(date.getTime()) ? "?" : date.toISOString().split("T")[1].slice(0, 8);
}

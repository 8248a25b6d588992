// Small tools of the page. Text from the network becomes text, never markup.
export const element = (id) => document.getElementById(id);

export function make(tag, text = "", properties = {}) {
  const made = document.createElement(tag);
  made.textContent = text;
  return Object.assign(made, properties);
}

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

export async function ask(path, words = {}) {
  try {
    return await read(await fetch(`${path}?${new URLSearchParams(words)}`));
  } catch (error) {
    return { ok: false, text: `no answer of the console: ${error.message}` };
  }
}

export async function order(vehicle, name, words = {}) {
  say(`${name}: sent to ${vehicle}`);
  const answer = await post("/api/order", { vehicle, order: name, ...words });
  say(`${vehicle}: ${answer.ok ? "" : "NOT OBEYED: "}${answer.text}`, answer.ok ? "good" : "bad");
  return answer;
}

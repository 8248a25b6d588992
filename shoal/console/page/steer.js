// Steering by keys, pointer and game pad: only while a dead-man switch is held, and only while this page is in front.
import { element, make, say } from "./page.js";

const PERIOD = 200; // ms between two commands
const DEAD_ZONE = 0.08; // of a stick that nobody touches
const SWITCHES = [4, 5, 6, 7]; // shoulder buttons of a game pad
const KEYS = { // what each key adds
  ArrowUp: ["ahead", 1], KeyW: ["ahead", 1], ArrowDown: ["ahead", -1], KeyS: ["ahead", -1],
  ArrowRight: ["turn", 1], KeyD: ["turn", 1], ArrowLeft: ["turn", -1], KeyA: ["turn", -1],
  PageUp: ["up", 1], KeyR: ["up", 1], PageDown: ["up", -1], KeyF: ["up", -1],
  KeyE: ["side", 1], KeyQ: ["side", -1],
};
const HELP = "Hold the space bar and press the arrow keys or W A S D; R and F: up and down; Q and E: sideways. "
  + "Or press here and pull. Or hold a shoulder button of a game pad. Letting go stops.";

export function makeSteer(store) {
  const begin = make("button", "Steer", { id: "steer-begin" }), end = make("button", "End steering", { id: "steer-end", hidden: true });
  const power = make("input", "", { id: "steer-power", type: "range", min: 10, max: 100, step: 10, value: 50 });
  const pad = make("div", "", { id: "steer-pad", tabIndex: 0 });
  const stick = make("span", "", { id: "steer-stick" }), help = make("span", HELP), state = make("p", "", { id: "steer-state" });
  const label = make("label", "Power "), share = make("output", "50 %");
  label.append(power, share);
  pad.setAttribute("role", "application");
  pad.setAttribute("aria-label", HELP);
  state.setAttribute("role", "status");
  pad.append(help, stick);
  const buttons = make("p");
  buttons.append(begin, " ", end);
  element("steer-view").append(buttons, label, pad, state);

  let socket = null; // open while this page steers
  let tick = null; // the newest one of the console, which each command names
  let timer = 0;
  const pressed = new Set();
  let pulled = null; // where the pointer pulls: [turn, ahead]

  const show = (text, kind = "") => { state.textContent = text; state.className = kind; };

  const gamePad = () => [...(navigator.getGamepads?.() ?? [])].find((each) =>
    each?.connected && SWITCHES.some((at) => each.buttons[at]?.pressed));
  const axis = (of, at) => Math.abs(of.axes[at] ?? 0) < DEAD_ZONE ? 0 : of.axes[at];

  // What the operator wants now; not held: neutral.
  const wanted = () => {
    const found = { ahead: 0, turn: 0, up: 0, side: 0 };
    if (document.hidden || !document.hasFocus()) return { held: false, ...found };
    const given = gamePad();
    if (given) {
      Object.assign(found, { turn: axis(given, 0), ahead: -axis(given, 1), side: axis(given, 2), up: -axis(given, 3) });
    } else if (pulled) {
      [found.turn, found.ahead] = pulled;
    } else if (pressed.has("Space")) {
      for (const key of pressed) if (KEYS[key]) found[KEYS[key][0]] += KEYS[key][1];
    } else return { held: false, ...found };
    for (const name of Object.keys(found)) found[name] = Math.max(-1, Math.min(1, found[name])) * power.value / 100;
    return { held: true, ...found };
  };

  const send = () => {
    const words = wanted();
    pad.classList.toggle("held", words.held);
    stick.style.left = `${50 + 45 * words.turn}%`;
    stick.style.top = `${50 - 45 * words.ahead}%`;
    // Commands that wait in front of a slow network would come late: none is added to them.
    if (socket?.readyState === WebSocket.OPEN && (!words.held || socket.bufferedAmount === 0)) {
      socket.send(JSON.stringify({ tick, ...words }));
    }
  };

  const release = () => { pressed.clear(); pulled = null; send(); };

  const finish = (text, kind) => {
    clearInterval(timer);
    pressed.clear();
    pulled = null;
    socket = null;
    pad.classList.remove("held");
    begin.hidden = false;
    end.hidden = true;
    show(text, kind);
  };

  const stop = () => {
    if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ end: true }));
    else socket?.close();
  };

  const start = () => {
    if (!store.chosen) { say("no vehicle is chosen", "warn"); return; }
    const vehicle = store.chosen;
    const opened = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/steering`);
    socket = opened;
    tick = null;
    let over = "the connection to the console is lost: steering has ended";
    begin.hidden = true;
    end.hidden = false;
    show(`${vehicle}: asked for steering`);
    opened.onopen = () => opened.send(JSON.stringify({ vehicle }));
    opened.onmessage = (event) => {
      const words = JSON.parse(event.data);
      if (words.state === "ended") { over = `${vehicle}: ${words.text}`; return; }
      if (tick === null) {
        pad.focus();
        timer = setInterval(send, PERIOD);
      }
      tick = words.tick;
      const held = pad.classList.contains("held");
      show(words.text || `${vehicle}: ${held ? "you steer" : "ready: hold the space bar, a shoulder button, or press here"}`,
        words.text ? "bad" : held ? "good" : "");
    };
    opened.onclose = () => { if (socket === opened) finish(over, over.endsWith("the operator has ended it") ? "" : "bad"); };
  };

  const pull = (event) => {
    const { left, top, width, height } = pad.getBoundingClientRect();
    const across = 2 * (event.clientX - left) / width - 1, down = 2 * (event.clientY - top) / height - 1;
    pulled = [across, -down].map((each) => Math.max(-1, Math.min(1, each / 0.9)));
  };

  begin.onclick = start;
  end.onclick = stop;
  power.oninput = () => { share.textContent = `${power.value} %`; };
  pad.onkeydown = (event) => {
    if (!socket || event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.code === "Escape") { stop(); return; }
    if (event.code !== "Space" && !KEYS[event.code]) return;
    event.preventDefault();
    if (pressed.has(event.code)) return;
    pressed.add(event.code);
    send();
  };
  pad.onkeyup = (event) => { if (pressed.delete(event.code)) send(); };
  pad.onpointerdown = (event) => { if (socket) { pad.setPointerCapture(event.pointerId); pull(event); send(); } };
  pad.onpointermove = (event) => { if (pulled) pull(event); };
  for (const over of ["pointerup", "pointercancel", "lostpointercapture"]) {
    pad.addEventListener(over, () => { if (pulled) { pulled = null; send(); } });
  }
  pad.addEventListener("blur", release);
  addEventListener("blur", release);
  document.addEventListener("visibilitychange", () => { if (document.hidden && socket) { release(); stop(); } });
  addEventListener("pagehide", () => socket?.close());
  // Another vehicle must not be steered by the same keys.
  return { draw: () => {}, choose: () => { if (socket) stop(); } };
}

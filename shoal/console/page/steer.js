// Steering by keys, pointer and game pad, only while a dead-man switch is held and this page is in front.
import { isChosen, openSocket, page, store, write } from "./page.js";

const PERIOD = 200; // ms between two commands
const DEAD_ZONE = 0.08; // of a stick that nobody touches
const SWITCHES = [4, 5, 6, 7]; // shoulder buttons of a game pad
const AXES = { // the keys for each direction, and against it
  ahead: [["ArrowUp", "KeyW"], ["ArrowDown", "KeyS"]], turn: [["ArrowRight", "KeyD"], ["ArrowLeft", "KeyA"]],
  up: [["PageUp", "KeyR"], ["PageDown", "KeyF"]], side: [["KeyE"], ["KeyQ"]],
};
const KEYS = ["Space", ...Object.values(AXES).flat(2)];

const begin = page.steerBegin, end = page.steerEnd, power = page.steerPower;
const pad = page.steerPad, stick = page.steerStick;
let socket = null; // open while this page steers
let tick = null; // the newest one of the console, which each command names
let timer = 0;
const pressed = new Set();
let pulled = null; // where the pointer pulls: [turn, ahead]

const show = (text, kind) => write(page.steerState, text, kind);
const isOpen = () => socket?.readyState === WebSocket.OPEN;

const gamePad = () => [...(navigator.getGamepads?.() ?? [])].find((each) =>
  each?.connected && SWITCHES.some((at) => each.buttons[at]?.pressed));
const axis = (of, at) => Math.abs(of.axes[at] ?? 0) < DEAD_ZONE ? 0 : of.axes[at];

const signOf = (keys) => keys.map((each) => each.some((key) => pressed.has(key))).reduce((more, less) => more - less);

// What the operator wants now; not held: neutral.
function wanted() {
  const found = { held: true, ahead: 0, turn: 0, up: 0, side: 0 }, given = gamePad();
  if (document.hidden || !document.hasFocus()) return { ...found, held: false };
  if (given) {
    Object.assign(found, { turn: axis(given, 0), ahead: -axis(given, 1), side: axis(given, 2), up: -axis(given, 3) });
  } else if (pulled) [found.turn, found.ahead] = pulled;
  else if (pressed.has("Space")) for (const [name, keys] of Object.entries(AXES)) found[name] = signOf(keys);
  else found.held = false;
  for (const name of Object.keys(AXES)) found[name] = Math.max(-1, Math.min(1, found[name])) * power.value / 100;
  return found;
}

function send() {
  const words = wanted();
  pad.classList.toggle("held", words.held);
  stick.style.left = `${50 + 45 * words.turn}%`;
  stick.style.top = `${50 - 45 * words.ahead}%`;
  // Commands that wait before a slow network come late: none is added.
  if (isOpen() && (!words.held || socket.bufferedAmount === 0)) socket.send(JSON.stringify({ tick, ...words }));
}

const forget = () => { pressed.clear(); pulled = null; };
const release = () => { forget(); send(); };

function finish(text, kind) {
  clearInterval(timer);
  forget();
  socket = null;
  pad.classList.remove("held");
  begin.hidden = false;
  end.hidden = true;
  show(text, kind);
}

function stop() {
  if (isOpen()) socket.send(JSON.stringify({ end: true })); else socket?.close();
}

function start() {
  const vehicle = store.chosen;
  if (!isChosen(vehicle)) return;
  const opened = openSocket("steering");
  socket = opened;
  tick = null;
  let over = "connection lost: steering has ended";
  begin.hidden = true;
  end.hidden = false;
  show(`${vehicle}: asked for steering`);
  opened.onopen = () => opened.send(JSON.stringify({ vehicle }));
  opened.onmessage = ({ data }) => {
    const words = JSON.parse(data);
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
}

function pull(event) {
  const { left, top, width, height } = pad.getBoundingClientRect();
  const across = 2 * (event.clientX - left) / width - 1, down = 2 * (event.clientY - top) / height - 1;
  pulled = [across, -down].map((each) => each / 0.9);
}

begin.onclick = start;
end.onclick = stop;
power.oninput = () => write(page.steerShare, `${power.value} %`);
pad.onkeydown = (event) => {
  const { code } = event;
  if (!socket || event.ctrlKey || event.altKey || event.metaKey) return;
  if (code === "Escape") stop();
  if (!KEYS.includes(code)) return;
  event.preventDefault();
  if (pressed.has(code)) return;
  pressed.add(code);
  send();
};
pad.onkeyup = ({ code }) => { if (pressed.delete(code)) send(); };
pad.onpointerdown = (event) => { if (socket) { pad.setPointerCapture(event.pointerId); pull(event); send(); } };
pad.onpointermove = (event) => { if (pulled) pull(event); };
pad.onpointerup = pad.onpointercancel = pad.onlostpointercapture = () => { if (pulled) { pulled = null; send(); } };
pad.onblur = release;
window.onblur = release;
document.onvisibilitychange = () => { if (document.hidden && socket) { release(); stop(); } };
window.onpagehide = () => socket?.close();
// Another vehicle must not be steered by the same keys.
export function choose() { if (socket) stop(); }

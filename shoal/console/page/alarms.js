// What has become worse: shown until it is acknowledged, and heard if Sound is on.
import { byName, clock, fill, make, page, press, store } from "./page.js";

const RANKS = { fault: 1, error: 2, failure: 3 };
const TONES = [440, 440, 660, 880]; // Hz, by rank
const BEEPS = [0, 0.25, 0.5], LENGTH = 0.15; // s
const PAUSE = 1000; // ms between two alarms that are heard
const MOST = 50;

const known = byName(); // by vehicle: { label, ranks: by entity, there, mode }
const alarms = new Map(); // text: { count, row }, the newest last
let audio = null;
let last = -PAUSE;
let silent = false;

function beep(rank) {
  if (!audio || performance.now() - last < PAUSE) return;
  last = performance.now();
  for (const begin of BEEPS.map((each) => audio.currentTime + each)) {
    const tone = new OscillatorNode(audio, { frequency: TONES[rank] });
    tone.connect(new GainNode(audio, { gain: 0.2 })).connect(audio.destination);
    tone.start(begin);
    tone.stop(begin + LENGTH);
  }
}

function show() {
  fill(page.alarmList, [...alarms.values()].map(({ row }) => row).reverse());
  page.alarms.hidden = !alarms.size;
}

function raise(text, rank) {
  const count = (alarms.get(text)?.count ?? 0) + 1, times = count > 1 ? ` (${count} times)` : "";
  alarms.delete(text);
  const row = make("li", `${clock(store.now)} ${text}${times}`, { className: rank > 1 ? "bad" : "warn" });
  alarms.set(text, { count, row });
  if (alarms.size > MOST) alarms.delete(alarms.keys().next().value);
  show();
  beep(rank);
}

function compare(name, { system, plan, health }) {
  const label = system?.name ?? name, before = known[name];
  const now = known[name] = { label, ranks: byName(), there: system?.there, mode: plan?.mode };
  for (const { entity, state, text } of health?.entities ?? []) {
    const rank = now.ranks[entity] = RANKS[state] ?? 0;
    if (before && rank > (before.ranks[entity] ?? 0)) raise(`${label}: ${entity}: ${state}: ${text}`, rank);
  }
  if (before?.there && now.there === false) raise(`${label}: LOST`, 3);
  if (before?.mode && before.mode !== "error" && now.mode === "error") raise(`${label}: mode error: ${plan.error ?? "aborted"}`, 3);
}

// In a log, states jump with the time that is shown.
export function draw(frame) {
  if (store.replay) return;
  for (const name of Object.keys(frame.vehicles)) compare(name, store.vehicles[name]);
  for (const name of frame.gone) {
    if (known[name]?.there) { raise(`${known[name].label}: LOST`, 3); known[name].there = false; }
  }
}

export function checkSilence(isSilent) {
  if (isSilent && !silent && Object.keys(known).length) raise("no data from the console", 3);
  silent = isSilent;
}

page.alarmsAcknowledge.onclick = () => { alarms.clear(); show(); };
// Browsers let a page sound only after a press.
page.sound.onclick = async ({ target }) => {
  if (audio) { await audio.close(); audio = null; } else { audio = new AudioContext(); last = -PAUSE; beep(0); }
  press(target, audio, "Sound is on", "Sound");
};

// What has become worse since this page was opened: shown until it is acknowledged, and heard if Sound is on.
import { byName, element, make } from "./page.js";

const RANKS = { normal: 0, boot: 0, fault: 1, error: 2, failure: 3 };
const TONES = [440, 440, 660, 880]; // Hz, by rank
const BEEPS = 3;
const PAUSE = 1000; // ms between two alarms that are heard
const MOST = 50;

export function makeAlarms(store) {
  const known = byName(); // by vehicle: { ranks: by entity, there, mode }
  const alarms = new Map(); // text: { count, rank, time, row }
  let audio = null;
  let last = -PAUSE;
  let silent = false;

  const beep = (rank) => {
    if (!audio || performance.now() - last < PAUSE) return;
    last = performance.now();
    for (let at = 0; at < BEEPS; at += 1) {
      const tone = audio.createOscillator(), volume = audio.createGain();
      tone.frequency.value = TONES[rank];
      volume.gain.value = 0.2;
      tone.connect(volume).connect(audio.destination);
      tone.start(audio.currentTime + at * 0.25);
      tone.stop(audio.currentTime + at * 0.25 + 0.15);
    }
  };

  const raise = (text, rank) => {
    const alarm = alarms.get(text) ?? { count: 0, row: make("li", "", { className: rank > 1 ? "bad" : "warn" }) };
    alarm.count += 1;
    alarm.row.textContent = `${new Date().toTimeString().slice(0, 8)} ${text}${alarm.count > 1 ? ` (${alarm.count} times)` : ""}`;
    alarms.set(text, alarm);
    if (alarms.size > MOST) alarms.delete(alarms.keys().next().value);
    element("alarm-list").replaceChildren(...[...alarms.values()].map(({ row }) => row).reverse());
    element("alarms").hidden = false;
    beep(rank);
  };

  const compare = (name, { system, plan, health }) => {
    const label = system?.name ?? name;
    const now = { ranks: byName(), there: system?.there, mode: plan?.mode };
    for (const { entity, state, text } of health?.entities ?? []) {
      now.ranks[entity] = RANKS[state] ?? 0;
      const before = known[name]?.ranks[entity] ?? 0;
      if (known[name] && now.ranks[entity] > before) raise(`${label}: ${entity}: ${state}: ${text}`, now.ranks[entity]);
    }
    const before = known[name];
    if (before?.there && now.there === false) raise(`${label}: LOST`, 3);
    if (before?.mode && before.mode !== "error" && now.mode === "error") raise(`${label}: mode error: ${plan.error ?? "aborted"}`, 3);
    known[name] = now;
  };

  // In a log, states jump with the time that is shown.
  const draw = (frame) => {
    element("sound").hidden = Boolean(store.replay);
    if (store.replay) return;
    for (const name of Object.keys(frame.vehicles)) compare(name, store.vehicles[name]);
    for (const name of frame.gone) {
      if (known[name]?.there) raise(`${name}: LOST`, 3);
      if (known[name]) known[name].there = false;
    }
  };

  const checkSilence = (isSilent) => {
    if (isSilent && !silent && Object.keys(known).length) raise("no data from the console", 3);
    silent = isSilent;
  };

  element("alarms-acknowledge").onclick = () => {
    alarms.clear();
    element("alarm-list").replaceChildren();
    element("alarms").hidden = true;
  };
  // Browsers let a page sound only after its user has pressed something on it.
  element("sound").onclick = async (event) => {
    if (audio) { await audio.close(); audio = null; } else { audio = new AudioContext(); last = -PAUSE; beep(0); }
    event.target.setAttribute("aria-pressed", String(Boolean(audio)));
    event.target.textContent = audio ? "Sound is on" : "Sound";
  };
  return { draw, checkSilence };
}

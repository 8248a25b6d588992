// A log: play, pause, speed, seek, resume from here. The server moves; this page shows where.
import { duration, failed, page, post, press, say, store, utc, write, writeAnswer } from "./page.js";

const form = page.replay, play = page.replayPlay, speed = page.replaySpeed, time = page.replayTime;
let wanted = null; // the position to ask for
let held = false; // the slider is in the user's hand

const control = async (words) => failed(await post("replay", words));

// One question at a time: the latest position waits for the answer before.
async function seek() {
  const isAsking = wanted !== null;
  wanted = Number(time.value);
  showClock(wanted);
  if (isAsking) return;
  let sent = null;
  while (sent !== wanted) {
    sent = wanted;
    await control({ position: sent });
  }
  wanted = null;
}

function showClock(position) {
  const { start, duration: end } = store.replay, now = utc(start + position).replace("T", " ").slice(0, 19) || "?";
  write(page.replayClock, `${duration(position)} of ${duration(end)}, ${now} UTC`);
}

export function draw() {
  const { replay } = store;
  document.body.classList.toggle("replay", Boolean(replay));
  form.hidden = !replay;
  if (!replay) return;
  press(play, replay.playing, "Pause", "Play");
  if (document.activeElement !== speed) speed.value = replay.speed;
  page.replayNotice.textContent = replay.notice;
  page.replayResume.hidden = !replay.resume;
  time.max = replay.duration;
  if (held || wanted !== null) return;
  time.value = replay.position;
  showClock(replay.position);
}

play.onclick = () => control({ playing: !store.replay.playing });
speed.onchange = () => control({ speed: Number(speed.value) });
time.oninput = () => { held = true; seek(); };
// A slider that is let go where it was has not changed.
time.onchange = time.onpointerup = time.onblur = () => { held = false; };
page.resume.onclick = async () => {
  say("repeating the run up to this time");
  const seconds = Number(page.resumeSeconds.value), change = page.resumeChange.value;
  writeAnswer(page.result, await post("resume", { position: Number(time.value), seconds, change }));
};

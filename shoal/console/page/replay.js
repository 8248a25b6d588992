// A log: play, pause, speed, seek, and resume from here. The server moves; this page shows where it is.
import { element, post, say } from "./page.js";

const SPEEDS = [0.25, 0.5, 1, 2, 5, 10, 30, 100];

export function makeReplay(store) {
  const play = element("replay-play"), speed = element("replay-speed"), time = element("replay-time");
  let wanted = null; // a position that was asked for, and the one that is being answered
  let asking = false;
  let held = false; // the slider is in the user's hand

  speed.replaceChildren(...SPEEDS.map((each) => new Option(`${each} ×`, each)));

  const control = async (words) => {
    const answer = await post("/api/replay", words);
    if (!answer.ok) say(answer.text, "bad");
  };

  // One question at a time: the latest position is asked for when the one before is answered.
  const seek = async () => {
    wanted = Number(time.value);
    showClock(wanted);
    if (asking) return;
    asking = true;
    while (wanted !== null) {
      const position = wanted;
      wanted = null;
      await control({ position });
    }
    asking = false;
  };

  const showClock = (position) => {
    const { start, duration } = store.replay;
    const date = new Date((start + position) * 1000);
    const utc = Number.isNaN(date.getTime()) ? "?" : date.toISOString().replace("T", " ").slice(0, 19);
    element("replay-clock").textContent = `${clock(position)} of ${clock(duration)}, ${utc} UTC`;
  };

  const draw = () => {
    const { replay } = store;
    document.body.classList.toggle("replay", Boolean(replay));
    element("replay").hidden = !replay;
    if (!replay) return;
    play.textContent = replay.playing ? "Pause" : "Play";
    play.setAttribute("aria-pressed", String(replay.playing));
    if (document.activeElement !== speed) speed.value = String(replay.speed);
    element("replay-notice").textContent = replay.notice;
    element("replay-resume").hidden = !replay.resume;
    time.max = replay.duration;
    if (held || asking) return;
    time.value = replay.position;
    showClock(replay.position);
  };

  play.onclick = () => control({ playing: !store.replay.playing });
  speed.onchange = () => control({ speed: Number(speed.value) });
  time.oninput = () => { held = true; seek(); };
  time.onchange = () => { held = false; };
  element("resume").onclick = async () => {
    say("resuming from here: the run is repeated up to this time");
    const seconds = Number(element("resume-seconds").value), change = element("resume-change").value;
    const answer = await post("/api/resume", { position: Number(time.value), seconds, change });
    say(answer.text, answer.ok ? "good" : "bad");
  };
  element("replay").onsubmit = (event) => event.preventDefault();
  return { draw };
}

function clock(seconds) {
  const whole = Math.floor(seconds);
  const parts = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  return parts.map((part) => String(part).padStart(2, "0")).join(":");
}

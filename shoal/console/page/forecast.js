// The rest of the running plan, simulated several times: tracks, circles and their summary.
import { duration, isChosen, make, makeAsk, page, post, press, repeat, store, write } from "./page.js";
import { makeLayer } from "./map_layer.js";

const PERIOD = 2000; // ms between questions
const COLOR = "#e6550d";

const toggle = page.forecastToggle, layer = makeLayer(), about = makeAsk();
let isOn = false;
let known = ""; // number of the forecast that is drawn

function clear(text) {
  layer.clear();
  known = "";
  write(page.forecastSummary, text);
  write(page.forecastAge, "");
}

function turn(on, text = "") {
  isOn = on;
  press(toggle, on, "End forecast", "Forecast");
  clear(text);
}

function show({ tracks, circles, number, summary, age, text }) {
  write(page.forecastSummary, (summary ? `${summary}. ` : "") + text);
  write(page.forecastAge, summary ? `(${duration(age)} old)` : "");
  if (tracks || number === undefined) layer.clear();
  if (!tracks) return;
  known = String(number);
  for (const track of tracks) layer.line(track, { color: COLOR, weight: 1, opacity: 0.6 });
  for (const { seconds, lat, lon, radius, runs } of circles) {
    layer.circle([lat, lon], { radius: Math.max(1, radius), color: COLOR, fillOpacity: 0.1, interactive: true })
      ?.bindTooltip(make("span", `+${duration(seconds)}`), { permanent: true, direction: "right", className: "mark" })
      .bindPopup(make("span", `in ${seconds} s: ${runs} of ${runs} runs within ${radius} m`));
  }
}

async function look() {
  const answer = isOn ? await about("forecast", { known }) : null;
  if (!answer || !isOn) return;
  if (!answer.ok) clear(answer.text);
  else if (answer.on) show(answer);
  else turn(false, answer.text || "ended: unused, or replaced by one of another vehicle");
}

// It ends by itself when no page asks for it.
toggle.onclick = async () => {
  const vehicle = store.chosen;
  if (isOn) return turn(false);
  if (!isChosen()) return;
  turn(true, "simulating: it takes some seconds");
  const horizon = Number(page.forecastHorizon.value), current = Number(page.forecastCurrent.value);
  const answer = await post("forecast", { vehicle, horizon, current });
  if (!answer.ok && vehicle === store.chosen) turn(false, answer.text);
};

export const choose = () => turn(false);
repeat(look, () => PERIOD);

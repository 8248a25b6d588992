// The rest of the running plan, simulated several times: tracks, circles and their summary.
import { ask, duration, isChosen, make, page, post, press, repeat, store, write } from "./page.js";
import { makeLayer } from "./map_layer.js";

const PERIOD = 2000; // ms between questions
const COLOR = "#e6550d";

const toggle = page.forecastToggle, layer = makeLayer();
let wanted = ""; // the vehicle whose forecast is on
let known = ""; // number of the forecast that is drawn

function clear(text) {
  layer.clear();
  known = "";
  write(page.forecastSummary, text);
}

function turn(vehicle, text = "") {
  wanted = vehicle;
  press(toggle, vehicle, "End forecast", "Forecast");
  clear(text);
}

function show({ tracks, circles, number, summary, age, text }) {
  write(page.forecastSummary, (summary ? `${summary} (${duration(age)} old). ` : "") + text);
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
  const vehicle = wanted;
  if (!vehicle || document.hidden) return;
  const answer = await ask("forecast", { vehicle, known });
  if (vehicle !== wanted) return;
  if (!answer.ok) clear(answer.text);
  else if (answer.on) show(answer);
  else turn("", answer.text || "ended: unused, or replaced by one of another vehicle");
}

// It ends by itself when no page asks for it.
toggle.onclick = async () => {
  if (wanted) { turn(""); return; }
  const vehicle = store.chosen;
  if (!isChosen(vehicle)) return;
  turn(vehicle, "simulating: it takes some seconds");
  const horizon = Number(page.forecastHorizon.value), current = Number(page.forecastCurrent.value);
  const answer = await post("forecast", { vehicle, horizon, current });
  if (!answer.ok && vehicle === wanted) turn("", answer.text);
};

const choose = () => { if (wanted && wanted !== store.chosen) turn(""); };
repeat(look, () => PERIOD);
export { choose };

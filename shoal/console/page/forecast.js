// The rest of the running plan, simulated several times: tracks and circles on the map, and their summary.
import { ask, element, make, post, say } from "./page.js";

const PERIOD = 2000; // ms between questions
const HORIZONS = [2, 5, 10, 30, 60]; // min
const COLOR = "#e6550d";

export function makeForecast(store) {
  const L = window.L, toggle = element("forecast-toggle"), summary = element("forecast-summary");
  const horizon = element("forecast-horizon"), current = element("forecast-current");
  const layer = L && store.map ? L.layerGroup().addTo(store.map) : null;
  let wanted = ""; // the vehicle whose forecast is on
  let known = ""; // number of the forecast that is drawn
  let asking = false;

  horizon.replaceChildren(...HORIZONS.map((each) => new Option(`${each} min`, each * 60)));
  horizon.value = "300";

  const clear = () => {
    layer?.clearLayers();
    known = "";
    summary.textContent = "";
  };

  const turn = (vehicle) => {
    wanted = vehicle;
    toggle.setAttribute("aria-pressed", String(Boolean(vehicle)));
    toggle.textContent = vehicle ? "End forecast" : "Forecast";
    clear();
  };

  const drawRuns = ({ tracks, circles }) => {
    layer?.clearLayers();
    if (!layer) return;
    for (const track of tracks) L.polyline(track, { color: COLOR, weight: 1, opacity: 0.6, interactive: false }).addTo(layer);
    for (const { seconds, lat, lon, radius, runs } of circles) {
      L.circle([lat, lon], { radius: Math.max(1, radius), color: COLOR, weight: 1, fillOpacity: 0.1 }).addTo(layer)
        .bindTooltip(make("span", `+${clock(seconds)}`), { permanent: true, direction: "right", className: "mark" })
        .bindPopup(make("span", `in ${seconds} s: ${runs} of ${runs} runs within ${radius} m`));
    }
  };

  const look = async () => {
    const vehicle = wanted;
    if (!vehicle || asking || document.hidden) return;
    asking = true;
    const answer = await ask("/api/forecast", { vehicle, known });
    asking = false;
    if (vehicle !== wanted) return;
    if (!answer.ok) { summary.textContent = answer.text; return; }
    if (!answer.on) {
      turn("");
      summary.textContent = answer.text || "ended: nobody has looked, or a forecast of another vehicle was begun";
      return;
    }
    if (answer.tracks) { drawRuns(answer); known = String(answer.number); }
    if (answer.number === undefined) layer?.clearLayers();
    const found = answer.summary ? `${answer.summary} (${clock(answer.age)} old). ` : "";
    summary.textContent = found + answer.text;
  };

  // It ends by itself when no page asks for it any more: another one may.
  toggle.onclick = async () => {
    if (wanted) { turn(""); return; }
    const vehicle = store.chosen;
    if (!vehicle) { say("no vehicle is chosen", "warn"); return; }
    turn(vehicle);
    summary.textContent = "simulating the rest of the plan: the first run takes some seconds";
    const words = { vehicle, horizon: Number(horizon.value), current: Number(current.value) };
    const answer = await post("/api/forecast", words);
    if (answer.ok || vehicle !== wanted) return;
    turn("");
    summary.textContent = answer.text;
  };

  const draw = () => { element("forecast").hidden = Boolean(store.replay); };
  const choose = () => { if (wanted && wanted !== store.chosen) turn(""); };
  setInterval(look, PERIOD);
  return { draw, choose };
}

const clock = (seconds) => `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}`;

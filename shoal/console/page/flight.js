// A plan flown in virtual time: how far it is, its track on the map, depth over the bottom, and battery.
import { ask, color, duration, failed, fill, make, page, post, postJob, repeat, say, store, write, writeAnswer } from "./page.js";
import { makeLayer } from "./map_layer.js";
import { makePlot } from "./plots.js";

const OPTIONS = { height: 140, scales: { x: { time: false } } };

const start = page.planFly, profile = page.flyProfile;
const layer = makeLayer();
let plots = [];

function clear() {
  for (const plot of plots) plot?.destroy();
  plots = [];
  fill(page.flyPlots);
  write(page.flyResult, "");
  layer.clear();
}

function drawMap(rows) {
  const places = rows.map(([, lat, lon]) => [lat, lon]).filter((place) => !place.includes(null));
  layer.line(places, { color: "#e7298a", weight: 3, opacity: 0.6 }, "flown in virtual time");
  layer.fit(places);
}

function drawPlots(rows) {
  const times = rows.map(([time]) => time);
  // A bottom far below the deepest place would flatten the track.
  const lowest = -3 * Math.max(1, ...rows.map(([, , , depth]) => depth ?? 0)) - 10;
  const below = (at) => rows.map((row) => row[at] === null || -row[at] < lowest ? null : -row[at]);
  const add = (series, data) => {
    const place = page.flyPlots.appendChild(make("div"));
    plots.push(makePlot(place, [{ label: "s" }, ...series], [times, ...data], OPTIONS));
  };
  add([{ label: "height (m)", stroke: color("link") }, { label: "bottom (m)", stroke: color("warn") }], [below(3), below(4)]);
  add([{ label: "battery (%)", stroke: color("good") }], [rows.map((row) => row[5])]);
}

start.onclick = async () => {
  const vehicle = store.chosen, text = page.planText.value;
  if (!text.trim()) return say("draw a plan first, or write one", "warn");
  clear();
  write(page.flyResult, "simulating");
  const answer = await postJob("flight", { vehicle, text, profile: profile.value || vehicle }, start, page.flyRunning);
  if (vehicle !== store.chosen) return;
  writeAnswer(page.flyResult, answer);
  if (!answer.rows?.length) return;
  drawMap(answer.rows);
  drawPlots(answer.rows);
  page.flyPlots.scrollIntoView({ block: "nearest" });
};
async function showProgress() {
  const { seconds = 0, percent = 0 } = start.disabled ? await ask("flight") : {};
  page.flyProgress.value = percent;
  write(page.flyTime, `${percent} %, ${duration(seconds)} of the vehicle's time`);
}
repeat(showProgress, () => 300);
page.flyCancel.onclick = async () => failed(await post("flight-cancel"));
export function choose() {
  clear();
  profile.placeholder = store.chosen;
}

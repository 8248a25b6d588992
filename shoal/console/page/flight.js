// A plan flown in virtual time before it is stored: its track on the map, depth over the bottom, and battery.
import { element, post, say } from "./page.js";

const HEIGHT = 140; // px of a plot

export function makeFlight(store) {
  const start = element("plan-fly"), cancel = element("fly-cancel"), profile = element("fly-profile");
  let plots = [];
  let latest = 0; // number of the latest flight: the answer to one before comes too late

  const clear = () => {
    for (const plot of plots) plot.destroy();
    plots = [];
    element("fly-plots").replaceChildren();
    element("fly-result").textContent = "";
    store.showFlight?.([]);
  };

  const drawPlots = (rows) => {
    if (!window.uPlot) return;
    const times = rows.map(([time]) => time);
    const below = (at) => rows.map((row) => row[at] === null ? null : -row[at]);
    // A bottom far below the deepest place would flatten the track.
    const deepest = Math.max(1, ...rows.map(([, , , depth]) => depth ?? 0));
    const bottom = below(4).map((height) => height === null || height < -3 * deepest - 10 ? null : height);
    const color = getComputedStyle(document.body).color;
    const axes = [{ stroke: color }, { stroke: color, size: 60 }];
    const width = Math.max(240, element("fly-plots").clientWidth - 10);
    const made = (series, data) => new window.uPlot({ width, height: HEIGHT, scales: { x: { time: false } }, axes,
      series: [{ label: "s" }, ...series] }, [times, ...data], element("fly-plots"));
    plots.push(made([{ label: "height (m)", stroke: "#0b57a4" }, { label: "bottom (m)", stroke: "#8c510a" }],
      [below(3), bottom]));
    plots.push(made([{ label: "battery (%)", stroke: "#146c2e" }], [rows.map((row) => row[5])]));
  };

  start.onclick = async () => {
    const text = element("plan-text").value;
    if (!text.trim()) { say("draw a plan and press As text, or write one", "warn"); return; }
    const mine = ++latest;
    clear();
    const result = element("fly-result");
    result.className = "";
    result.textContent = "in flight: it takes some seconds";
    start.disabled = true;
    cancel.hidden = false;
    const answer = await post("/api/flight", { vehicle: store.chosen, text, profile: profile.value || store.chosen });
    start.disabled = false;
    cancel.hidden = true;
    if (mine !== latest) return;
    result.textContent = answer.text;
    result.className = answer.ok ? "good" : "bad";
    const rows = answer.rows ?? [];
    store.showFlight(rows);
    if (rows.length) drawPlots(rows);
  };
  cancel.onclick = async () => {
    const answer = await post("/api/flight-cancel", {});
    if (!answer.ok) say(answer.text, "bad");
  };
  const choose = () => {
    latest += 1;
    clear();
    profile.placeholder = store.chosen;
  };
  return { draw: () => {}, choose };
}

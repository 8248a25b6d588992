"use strict";
const page = document.querySelector("main");
const duration = Number(page.dataset.duration), start = Number(page.dataset.start);
const LEFT = 132, INNER = 858, SPACE = "http://www.w3.org/2000/svg";
const STEPS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 21600, 43200, 86400];
const charts = [...document.querySelectorAll("svg.time")].map(readChart);
const tip = document.getElementById("tip"), reset = document.getElementById("reset");
const map = document.querySelector("svg.map");
const places = map && map.dataset.places ? map.dataset.places.split(";").map((place) => place.split(",").map(Number)) : [];
let shown = [0, duration], pressed = null;

function readChart(svg) {
  const plot = Number(svg.dataset.plot), top = Number(svg.dataset.top), bottom = Number(svg.dataset.bottom);
  const caption = svg.closest("figure").querySelector(".legend");
  const curves = [...svg.querySelectorAll(".curve")].map((path) => {
    const numbers = path.getAttribute("d").split(/[ML ]/).filter(Boolean).map(Number);
    const times = [], values = [];
    for (let i = 0; i < numbers.length; i += 2) {
      times.push((numbers[i] / INNER) * duration);
      values.push(bottom + (1 - numbers[i + 1] / plot) * (top - bottom));
    }
    const key = [...caption.querySelectorAll(".key")].find((key) => key.dataset.name === path.dataset.name);
    return { times, values, key };
  });
  return { svg, curves, plot: svg.querySelector(".plot"), cursor: svg.querySelector(".cursor"),
           choice: svg.querySelector(".choice"), times: svg.querySelector(".times") };
}

function nearest(times, time) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] < time) low = middle + 1; else high = middle;
  }
  return low > 0 && time - times[low - 1] < times[low] - time ? low - 1 : low;
}

function clock(seconds, digits) {
  const whole = Math.floor(seconds + 1e-6), h = Math.floor(whole / 3600), m = Math.floor((whole % 3600) / 60);
  const s = (seconds - 3600 * h - 60 * m).toFixed(digits).padStart(digits ? 3 + digits : 2, "0");
  return h ? `${h}:${String(m).padStart(2, "0")}:${s}` : `${m}:${s}`;
}

const timeOf = (svg, event) => {
  const box = svg.getBoundingClientRect(), x = ((event.clientX - box.left) / box.width) * 1000 - LEFT;
  return shown[0] + (Math.min(Math.max(x, 0), INNER) / INNER) * (shown[1] - shown[0]);
};
const xOf = (time) => LEFT + ((time - shown[0]) / (shown[1] - shown[0])) * INNER;

function point(time) {
  for (const chart of charts) {
    const x = xOf(time);
    chart.cursor.setAttribute("x1", x);
    chart.cursor.setAttribute("x2", x);
    chart.cursor.style.visibility = "visible";
    for (const { times, values, key } of chart.curves) {
      if (!key || !times.length) continue;
      const index = nearest(times, time), known = Math.abs(times[index] - time) < Math.max(5, duration / 300);
      key.querySelector("b").textContent = known ? `${values[index].toFixed(key.dataset.digits)} ${key.dataset.unit}` : "";
    }
  }
  if (places.length) {
    const [, x, y, heading] = places[nearest(places.map((place) => place[0]), time)];
    const vehicle = map.querySelector(".vehicle");
    vehicle.setAttribute("transform", `translate(${x} ${y}) rotate(${heading})`);
    vehicle.setAttribute("visibility", "visible");
  }
}

function say(event, text) {
  tip.textContent = text;
  tip.style.visibility = text ? "visible" : "hidden";
  tip.style.left = `${Math.min(event.clientX + 14, innerWidth - tip.offsetWidth - 8)}px`;
  tip.style.top = `${Math.min(event.clientY + 16, innerHeight - tip.offsetHeight - 8)}px`;
}

function leave() {
  for (const chart of charts) {
    chart.cursor.style.visibility = chart.choice.style.visibility = "hidden";
    for (const { key } of chart.curves) if (key) key.querySelector("b").textContent = "";
  }
  if (places.length) map.querySelector(".vehicle").setAttribute("visibility", "hidden");
  tip.style.visibility = "hidden";
}

function zoom(begin, end) {
  shown = [begin, end];
  const step = STEPS.find((step) => step * 9 >= end - begin) || 86400;
  for (const chart of charts) {
    const [, , , height] = chart.plot.getAttribute("viewBox").split(" ").map(Number);
    const x = (begin / duration) * INNER, width = ((end - begin) / duration) * INNER;
    chart.plot.setAttribute("viewBox", `${x} 0 ${width} ${height}`);
    for (const text of chart.plot.querySelectorAll("text")) {
      const at = text.getAttribute("x");
      text.setAttribute("transform", `translate(${at} 0) scale(${width / INNER} 1) translate(${-at} 0)`);
    }
    const y = chart.svg.viewBox.baseVal.height - 6;
    chart.times.replaceChildren();
    for (let at = Math.ceil(begin / step - 1e-9) * step; at <= end + 1e-9; at += step) {
      const text = document.createElementNS(SPACE, "text");
      text.setAttribute("class", "tick");
      text.setAttribute("x", xOf(at));
      text.setAttribute("y", y);
      text.setAttribute("text-anchor", "middle");
      text.textContent = clock(at, step < 1 ? 1 : 0);
      chart.times.append(text);
    }
  }
  reset.hidden = begin <= 0 && end >= duration;
}

for (const { svg, choice } of charts) {
  svg.addEventListener("pointermove", (event) => {
    const time = timeOf(svg, event);
    point(time);
    const utc = Number.isFinite(start) ? new Date((start + time) * 1000).toISOString().slice(11, 21) + " UTC" : "";
    say(event, event.target.dataset.tip || `${clock(time, 1)} · ${utc}`);
    if (pressed !== null) {
      choice.setAttribute("x", Math.min(xOf(pressed), xOf(time)));
      choice.setAttribute("width", Math.abs(xOf(time) - xOf(pressed)));
      choice.style.visibility = "visible";
    }
  });
  svg.addEventListener("pointerdown", (event) => {
    if (event.button === 0) { pressed = timeOf(svg, event); svg.setPointerCapture(event.pointerId); }
  });
  svg.addEventListener("pointerup", (event) => {
    const [begin, end] = [pressed, timeOf(svg, event)].sort((a, b) => a - b);
    pressed = null;
    choice.style.visibility = "hidden";
    if (end - begin > (shown[1] - shown[0]) / 100) zoom(begin, end);
  });
  svg.addEventListener("dblclick", () => zoom(0, duration));
  svg.addEventListener("pointerleave", leave);
}
reset.addEventListener("click", () => zoom(0, duration));

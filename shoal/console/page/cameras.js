// Pictures of the chosen vehicle's cameras with detections, only while this view is seen.
import { button, make, makeAsk, page, press, repeat, store, utc, write } from "./page.js";

const FAST = 200, SLOW = 1000; // ms between questions
const OLD = 5; // s, from which a picture is not live; a vehicle of a fast clock has older ones

const shown = new Map(); // by camera: its figure
let live = ""; // the camera whose pictures come at a higher rate
let asking = false;
const marked = page.camerasMarks, about = makeAsk();

function addFigure(camera) {
  const image = make("img"), marks = drawing("svg"), name = make("strong"), note = make("span");
  const watch = button("Live", () => { live = live === camera ? "" : camera; mark(); look(); });
  const save = make("a", "Save", { className: "button" });
  const caption = make("figcaption", [name, note, watch, save], { className: "form" });
  const figure = make("figure", [caption, make("div", [image, marks], { className: "picture" })]);
  const made = { figure, name, image, marks, note, watch, save, url: "", number: null };
  page.cameras.append(figure);
  shown.set(camera, made);
  return made;
}

const mark = () => { for (const [name, { watch }] of shown) press(watch, name === live); };

function keep(names) {
  for (const [name, { url, figure }] of shown) {
    if (names.includes(name)) continue;
    URL.revokeObjectURL(url);
    figure.remove();
    shown.delete(name);
  }
}

function fileOf({ time, label, format }) {
  const stamp = utc(time).replace(/[-:]/g, "") || "time-unknown";
  const words = [store.chosen, label, stamp].map((each) => each.replace(/[^A-Za-z0-9.-]+/g, "_"));
  return `${words.join("_")}.${format}`;
}

// Of a picture that cannot be decoded, the one before stays with its age.
async function load(each, camera) {
  const words = new URLSearchParams({ vehicle: store.chosen, camera: camera.camera, number: camera.number });
  let url = "";
  try {
    const answer = await fetch(`/api/picture?${words}`, { signal: AbortSignal.timeout(8000) });
    if (answer.status === 204) return; // a newer one is there
    if (!answer.ok) throw new Error(await answer.text());
    url = URL.createObjectURL(await answer.blob());
    await make("img", "", { src: url }).decode();
    each.image.src = url;
    Object.assign(each.save, { href: url, download: fileOf(camera) });
    [url, each.url] = [each.url, url];
    Object.assign(each, { picture: camera, trouble: "" });
  } catch (error) {
    each.trouble = error.name === "EncodingError" ? "a damaged picture" : error.message;
  }
  each.number = camera.number;
  URL.revokeObjectURL(url);
}

// In a log, there is no picture before the first one.
function clear(each) {
  each.image.removeAttribute("src");
  Object.assign(each, { picture: null, number: null, trouble: "" });
}

function drawMarks({ marks, picture }, camera) {
  marks.replaceChildren();
  if (!picture || !marked.checked || camera.number !== picture.number) return;
  const { width, height } = picture;
  marks.setAttribute("viewBox", `0 0 ${width} ${height}`);
  for (const { u, v, size, label } of camera.marks) {
    const words = { x: u + size / 2, y: v - size / 2, "font-size": Math.max(width, height) / 40 };
    marks.append(drawing("circle", { cx: u, cy: v, r: size / 2 }), drawing("text", words, label));
  }
}

function tell(each, { label, age, trouble }) {
  const { picture, name, image, watch, save } = each;
  write(name, label); // which may come after the first picture
  image.alt = `picture of ${label}`;
  watch.ariaLabel = `Live pictures of ${label}`;
  save.ariaLabel = `Save the picture of ${label}`;
  save.hidden = !picture;
  const isOld = !store.replay && !(Math.abs(age ?? NaN) <= OLD);
  const words = [picture ? `${picture.width} × ${picture.height}` : "no picture yet"];
  if (picture && age !== null) words.push(`${age.toFixed(1)} s old`);
  if (picture && isOld) words.push("NOT LIVE");
  const troubles = [trouble, each.trouble].filter(Boolean);
  write(each.note, [...words, ...troubles].join(" · "), isOld || troubles.length ? "warn" : "");
  each.figure.classList.toggle("old", isOld);
}

async function show(answer) {
  const vehicle = store.chosen;
  write(page.camerasNote, answer.ok ? answer.note : answer.text);
  if (!answer.ok) { // how old the pictures are is not known
    for (const each of shown.values()) tell(each, { label: each.name.textContent, age: null });
    return;
  }
  keep(answer.cameras.map(({ camera }) => camera));
  for (const camera of answer.cameras) {
    const each = shown.get(camera.camera) ?? addFigure(camera.camera);
    each.watch.hidden = Boolean(store.replay);
    if (camera.number === null) clear(each);
    else if (each.number !== camera.number) await load(each, camera);
    if (vehicle !== store.chosen) return;
    drawMarks(each, camera);
    tell(each, camera);
  }
  mark();
}

async function look() {
  if (asking || page.camerasView.hidden) return;
  asking = true;
  try {
    const answer = await about("cameras", { live });
    if (answer) await show(answer);
  } finally {
    asking = false;
  }
}

repeat(look, () => live || store.replay?.playing ? FAST : SLOW);
marked.onchange = look;
export function choose() {
  keep([]);
  live = "";
  write(page.camerasNote, "");
}
export { look as open };

function drawing(tag, words = {}, text = "") {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(words)) made.setAttribute(name, value);
  made.textContent = text;
  return made;
}

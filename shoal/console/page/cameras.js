// Pictures of the chosen vehicle's cameras, with what was detected in them; only while this view is seen.
import { ask, element, make, say } from "./page.js";

const FAST = 200, SLOW = 1000; // ms between questions, with and without a live camera
const OLD = 5; // s, from which a picture is not live; a vehicle of a fast clock has older ones
const SVG = "http://www.w3.org/2000/svg";

export function makeCameras(store) {
  const shown = new Map(); // by camera: its figure
  let live = ""; // the camera whose pictures come at a higher rate
  let of = ""; // the vehicle
  let asking = false;
  const place = element("cameras"), note = element("cameras-note"), marked = element("cameras-marks");
  const isSeen = () => !element("cameras-view").hidden && !document.hidden;

  const addFigure = (camera) => {
    const image = make("img");
    const marks = document.createElementNS(SVG, "svg");
    const name = make("strong"), told = make("output"), watch = make("button", "Live"), save = make("button", "Save");
    const frame = make("div", "", { className: "picture" }), figure = make("figure");
    const caption = make("figcaption", "", { className: "form" });
    frame.append(image, marks);
    caption.append(name, told, watch, save);
    figure.append(caption, frame);
    place.append(figure);
    const made = { figure, name, image, marks, told, watch, save, url: "", number: null };
    watch.onclick = () => { live = live === camera.camera ? "" : camera.camera; mark(); look(); };
    save.onclick = () => savePicture(made);
    shown.set(camera.camera, made);
    return made;
  };

  const mark = () => {
    for (const [name, each] of shown) each.watch.setAttribute("aria-pressed", String(name === live));
  };

  const remove = (name) => {
    const each = shown.get(name);
    if (each.url) URL.revokeObjectURL(each.url);
    each.figure.remove();
    shown.delete(name);
  };

  const savePicture = ({ url, picture }) => {
    if (!url) { say("there is no picture to save", "warn"); return; }
    const time = new Date(picture.time * 1000);
    const stamp = Number.isNaN(time.getTime()) ? "time-unknown" : time.toISOString().replace(/[-:]/g, "");
    const words = [of, picture.label, stamp].map((each) => each.replace(/[^A-Za-z0-9.-]+/g, "_"));
    make("a", "", { href: url, download: `${words.join("_")}.${picture.format}` }).click();
  };

  // A picture that the browser cannot decode is none: the one before stays, with its age.
  const load = async (each, camera) => {
    const words = new URLSearchParams({ vehicle: of, camera: camera.camera, number: camera.number });
    let url = "";
    try {
      const answer = await fetch(`/api/picture?${words}`, { signal: AbortSignal.timeout(8000) });
      if (answer.status === 204) return; // a newer one is there
      if (!answer.ok) throw new Error(await answer.text());
      url = URL.createObjectURL(await answer.blob());
      const next = new Image();
      next.src = url;
      await next.decode();
      each.image.src = url;
      [url, each.url] = [each.url, url];
      each.picture = camera;
      each.trouble = "";
    } catch (error) {
      each.trouble = error.name === "EncodingError" ? "a damaged picture" : error.message;
    }
    each.number = camera.number;
    if (url) URL.revokeObjectURL(url);
  };

  // In a log, there is no picture before the first one.
  const clear = (each) => {
    each.image.removeAttribute("src");
    Object.assign(each, { picture: null, number: null, trouble: "" });
  };

  const drawMarks = (each, camera) => {
    each.marks.replaceChildren();
    const { picture } = each;
    if (!picture || !marked.checked || camera.number !== picture.number) return;
    each.marks.setAttribute("viewBox", `0 0 ${picture.width} ${picture.height}`);
    for (const { u, v, size, label } of camera.marks) {
      const circle = document.createElementNS(SVG, "circle"), words = document.createElementNS(SVG, "text");
      for (const [name, value] of Object.entries({ cx: u, cy: v, r: size / 2 })) circle.setAttribute(name, value);
      for (const [name, value] of Object.entries({ x: u + size / 2, y: v - size / 2 })) words.setAttribute(name, value);
      words.setAttribute("font-size", Math.max(picture.width, picture.height) / 40);
      words.textContent = label;
      each.marks.append(circle, words);
    }
  };

  const tell = (each, camera) => {
    if (each.name.textContent !== camera.label) { // which may come after the first picture
      each.name.textContent = camera.label;
      each.image.alt = `picture of ${camera.label}`;
      each.watch.setAttribute("aria-label", `Live pictures of ${camera.label}`);
      each.save.setAttribute("aria-label", `Save the picture of ${camera.label}`);
    }
    const { age, trouble } = camera, { picture } = each;
    const isOld = age === null || age > OLD || age < -OLD;
    const words = [picture ? `${picture.width} × ${picture.height}` : "no picture yet"];
    if (picture && age !== null) words.push(`${age.toFixed(1)} s old`);
    if (picture && isOld && !store.replay) words.push("NOT LIVE");
    words.push(...[trouble, each.trouble].filter(Boolean));
    each.told.textContent = words.join(" · ");
    each.told.className = trouble || each.trouble || (isOld && !store.replay) ? "warn" : "";
    each.figure.classList.toggle("old", isOld && !store.replay);
  };

  const look = async () => {
    if (asking || !isSeen() || !store.chosen) return;
    asking = true;
    const vehicle = store.chosen;
    if (vehicle !== of) { for (const name of [...shown.keys()]) remove(name); of = vehicle; live = ""; }
    const answer = await ask("/api/cameras", { vehicle, live });
    if (vehicle === store.chosen) {
      note.textContent = answer.ok ? answer.note : answer.text;
      const cameras = answer.cameras ?? [];
      if (answer.ok) for (const name of [...shown.keys()]) if (!cameras.some((each) => each.camera === name)) remove(name);
      for (const camera of cameras) {
        const each = shown.get(camera.camera) ?? addFigure(camera);
        each.watch.hidden = Boolean(store.replay);
        if (camera.number === null) clear(each);
        else if (each.number !== camera.number) await load(each, camera);
        drawMarks(each, camera);
        tell(each, camera);
      }
      mark();
    }
    asking = false;
  };

  const turn = async () => {
    await look();
    setTimeout(turn, live || store.replay?.playing ? FAST : SLOW);
  };
  turn();
  marked.onchange = look;
  return { draw: () => {}, open: look, choose: look };
}

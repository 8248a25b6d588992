// The log books of all vehicles, the newest entry first.
import { cell, clock, fill, matches, page, row, small, store } from "./page.js";

const MOST = 300; // entries

const filter = page.logFilter, view = page.logView;
let dirty = true;
function show() {
  const found = store.log.filter((entry) => matches(filter, ...entry)).slice(-MOST).reverse();
  fill(page.entries, found.map(([time, vehicle, kind, context, text]) =>
    row(cell(clock(time), "whole"),
      cell([text, small([vehicle, context].filter(Boolean).join(" · "))], kind))));
  dirty = false;
}
function draw(frame) {
  dirty ||= frame.all || frame.log.length > 0;
  if (dirty && !view.hidden) show();
}
filter.oninput = show;
export { draw, show as open };

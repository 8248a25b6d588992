// Rates of all messages, counted while this table is open.
import { ask, fill, makeLatest, matches, page, repeat, row, store, write } from "./page.js";

const PERIOD = 2000; // ms
const WHOLE = 120000; // ms to count a whole log

const box = page.ratesBox, filter = page.ratesFilter, latest = makeLatest();
let rows = [];
let counted = ""; // the vehicle whose whole log is counted

const drawRows = () => fill(page.rates, rows.filter(([message, entity]) => matches(filter, message, entity))
  .map((values) => row(...values.map((value) => value ?? "?"))));

async function read() {
  const vehicle = store.chosen;
  if (!box.open || page.plotsView.hidden || document.hidden || !vehicle || counted === vehicle) return;
  const answer = await latest(ask("rates", { vehicle }, WHOLE));
  if (!answer) return;
  counted = store.replay && answer.ok ? vehicle : "";
  rows = answer.rows ?? [];
  write(page.ratesNote, !answer.ok ? answer.text
    : answer.seconds ? `${rows.length} kinds, counted over ${answer.seconds} s` : "counting");
  drawRows();
}

filter.oninput = drawRows;
box.ontoggle = read;
repeat(read, () => PERIOD);
export function choose() {
  latest();
  rows = [];
  counted = "";
  write(page.ratesNote, "");
  drawRows();
  read();
}

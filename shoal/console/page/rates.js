// Rates of all messages, counted while this table is open.
import { fill, makeAsk, matches, page, repeat, row, store, write } from "./page.js";

const PERIOD = 2000; // ms
const WHOLE = 120000; // ms to count a whole log

const box = page.ratesBox, filter = page.ratesFilter, about = makeAsk();
let rows = [];
let counted = false; // the whole log

const drawRows = () => fill(page.rates, rows.filter(([message, entity]) => matches(filter, message, entity))
  .map((values) => row(...values.map((value) => value ?? "?"))));

async function read() {
  if (!box.open || page.plotsView.hidden || counted) return;
  const answer = await about("rates", {}, WHOLE);
  if (!answer) return;
  counted = store.replay && answer.ok;
  rows = answer.rows ?? [];
  write(page.ratesNote, !answer.ok ? answer.text
    : answer.seconds ? `${rows.length} kinds, counted over ${answer.seconds} s` : "counting");
  drawRows();
}

filter.oninput = drawRows;
box.ontoggle = read;
repeat(read, () => PERIOD);
export function choose() {
  rows = [];
  counted = false;
  write(page.ratesNote, "");
  drawRows();
  read();
}

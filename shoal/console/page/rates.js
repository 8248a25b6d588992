// Rates of all messages of a vehicle, which it counts while this table is open.
import { ask, element, make } from "./page.js";

const PERIOD = 2000; // ms
const WHOLE = 120000; // ms to count a whole log

export function makeRates(store) {
  const box = element("rates-box"), note = element("rates-note");
  let rows = [];
  let timer = 0;
  let wasOpen = false;
  let latest = 0; // number of the latest question: answers to those before it come too late

  const isOpen = () => box.open && !element("plots-view").hidden;

  const drawRows = () => {
    const words = element("rates-filter").value.toLowerCase();
    const shown = rows.filter(([message, entity]) => `${message} ${entity}`.toLowerCase().includes(words));
    element("rates").replaceChildren(...shown.map((row) => {
      const line = make("tr");
      line.append(...row.map((value) => make("td", value === null ? "?" : String(value))));
      return line;
    }));
  };

  const read = async () => {
    clearTimeout(timer);
    const vehicle = store.chosen, mine = ++latest;
    if (!isOpen() || !vehicle) return;
    const answer = await ask("/api/rates", { vehicle }, WHOLE);
    if (mine !== latest) return;
    rows = answer.rows ?? [];
    note.textContent = !answer.ok ? answer.text
      : answer.seconds ? `${rows.length} kinds, counted over ${answer.seconds} s` : "counting";
    drawRows();
    if (!store.replay || !answer.ok) timer = setTimeout(read, PERIOD);
  };

  const draw = () => {
    if (wasOpen === isOpen()) return;
    wasOpen = isOpen();
    read();
  };
  element("rates-filter").oninput = drawRows;
  const forget = () => { rows = []; drawRows(); read(); };
  return { draw, choose: forget };
}

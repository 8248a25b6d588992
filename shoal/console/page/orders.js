// Abort, hold and surface: pressed, and pressed again within three seconds to confirm.
import { isChosen, kindOf, order, page, post, say, store, told } from "./page.js";

const CONFIRM = 3000; // ms

const armed = new Set(); // what disarms the buttons that are pressed once

for (const name of ["hold", "surface", "abort"]) {
  confirmed(page[name], () => {
    const vehicle = store.chosen;
    return isChosen() && (() => order(vehicle, name));
  });
}
confirmed(page.abortAll, () => abortAll);
// The second press confirms an order to the vehicle of the first one, to no other.
export function choose() { for (const disarm of armed) disarm(); }

// One request, so that no vehicle waits for a connection of the browser.
async function abortAll() {
  say("abort-all: sent to every vehicle");
  const { answers, text } = await post("order", { order: "abort-all" });
  if (!answers) return say(`NOT OBEYED: ${text}`, "bad");
  if (!answers.length) return say("no vehicle is known", "bad");
  const kinds = answers.map(kindOf), worst = ["bad", "warn"].find((kind) => kinds.includes(kind)) ?? "good";
  say(answers.map((each) => told(each.vehicle, each)).join(" | "), worst);
}

// `begin` gives what a second press does, or nothing.
export function confirmed(pressed, begin) {
  const label = pressed.textContent;
  let timer = 0;
  let act = null;
  function disarm() {
    clearTimeout(timer);
    armed.delete(disarm);
    act = null;
    pressed.textContent = label;
    pressed.classList.remove("armed");
  }
  pressed.onclick = () => {
    const confirmedAct = act;
    disarm();
    if (confirmedAct) return confirmedAct();
    act = begin();
    if (!act) return;
    pressed.textContent = `${label}: press again`;
    pressed.classList.add("armed");
    armed.add(disarm);
    timer = setTimeout(disarm, CONFIRM);
  };
}

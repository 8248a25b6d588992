// Abort, hold and surface: pressed, and pressed again within three seconds to confirm.
import { element, kindOf, order, post, say, told } from "./page.js";

const CONFIRM = 3000; // ms

export function makeOrders(store) {
  const buttons = ["hold", "surface", "abort"].map((name) => confirmed(element(name), () => {
    const vehicle = store.chosen; // at the first press: the second one confirms the order to this vehicle, to no other
    if (vehicle) return () => order(vehicle, name);
    say("no vehicle is chosen", "warn");
    return null;
  }));
  buttons.push(confirmed(element("abort-all"), () => abortAll));
  return { disarm: () => { for (const disarm of buttons) disarm(); } };
}

// One request, so that no vehicle waits for a connection of the browser.
async function abortAll() {
  say("abort-all: sent to every vehicle");
  const answer = await post("/api/order", { order: "abort-all" });
  if (!answer.answers) { say(`NOT OBEYED: ${answer.text}`, "bad"); return; }
  if (!answer.answers.length) { say("no vehicle is known", "bad"); return; }
  const kinds = answer.answers.map(kindOf);
  const worst = ["bad", "warn"].find((kind) => kinds.includes(kind)) ?? "good";
  say(answer.answers.map((each) => told(each.vehicle, each)).join(" | "), worst);
}

// `begin` gives what a second press does, or null. Returns how to disarm the button.
export function confirmed(button, begin) {
  const label = button.textContent;
  let timer = 0;
  let act = null;
  const disarm = () => {
    clearTimeout(timer);
    act = null;
    button.textContent = label;
    button.classList.remove("armed");
  };
  button.onclick = async () => {
    if (act) {
      const confirmedAct = act;
      disarm();
      await confirmedAct();
      return;
    }
    act = begin();
    if (!act) return;
    button.textContent = `${label}: press again`;
    button.classList.add("armed");
    timer = setTimeout(disarm, CONFIRM);
  };
  return disarm;
}

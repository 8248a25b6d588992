// Abort, hold and surface: pressed, and pressed again within three seconds to confirm.
import { element, order, say } from "./page.js";

const CONFIRM = 3000; // ms

export function makeOrders(store) {
  for (const name of ["hold", "surface", "abort"]) {
    confirmed(element(name), () => store.chosen && order(store.chosen, name));
  }
  confirmed(element("abort-all"), async () => {
    const names = Object.keys(store.vehicles);
    const answers = await Promise.all(names.map((name) => order(name, "abort")));
    const texts = names.map((name, at) => `${name}: ${answers[at].ok ? "" : "NOT OBEYED: "}${answers[at].text}`);
    say(texts.join(" | "), answers.every((answer) => answer.ok) ? "good" : "bad");
  });
}

function confirmed(button, act) {
  const label = button.textContent;
  let timer = 0;
  const disarm = () => { clearTimeout(timer); timer = 0; button.textContent = label; button.classList.remove("armed"); };
  button.onclick = async () => {
    if (timer) { disarm(); await act(); return; }
    button.textContent = `${label}: press again`;
    button.classList.add("armed");
    timer = setTimeout(disarm, CONFIRM);
  };
}

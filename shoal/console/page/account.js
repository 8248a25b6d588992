// Who I am, a login with a password, and who commands the chosen vehicle.
import { ask, element, make, post, say } from "./page.js";

const LOG_IN = "Log in: open the link that `shoal console` or `shoal run` has printed.";

export function makeAccount(store) {
  let me = null; // session, user and role
  let refusal = ""; // why the login by a link was refused

  const certificate = make("button", "", { id: "login-certificate", type: "button", hidden: true });
  element("login").append(certificate);

  const byLink = async () => {
    const token = location.hash.slice(1);
    if (!token) return;
    history.replaceState(null, "", "/");
    const answer = await post("/api/login", { token });
    if (!answer.ok) { refusal = `${answer.text}. `; say(answer.text, "bad"); }
  };

  // Asks who this page is; without a session, how to log in. Whether there is a session.
  const recall = async () => {
    const answer = await ask("/api/me");
    me = answer.ok ? answer : null;
    element("me").textContent = me ? `${me.user} (${me.role})` : "";
    element("logout").hidden = !me;
    element("login").hidden = me !== null || !(answer.passwords || answer.certificate);
    certificate.hidden = !answer.certificate;
    certificate.textContent = `Log in as ${answer.certificate} by certificate`;
    if (me) { if (element("result").textContent.endsWith(LOG_IN)) say(""); return true; }
    if (answer.passwords !== undefined) say(refusal + LOG_IN, "bad");
    return false;
  };

  const change = async (words) => {
    if (!store.chosen) return;
    const answer = await post("/api/lease", { vehicle: store.chosen, change: words });
    say(`${store.chosen}: ${answer.text}`, answer.ok ? "good" : "bad");
  };

  const draw = () => {
    const lease = store.leases[store.chosen];
    const mine = lease && me && lease.session === me.session;
    const asked = lease?.asked ? `; ${lease.asked} asks for it, ${lease.left} s left` : "";
    element("lease").textContent = lease ? `${mine ? "you command" : `${lease.user} commands`}${asked}` : "nobody commands";
    element("lease").classList.toggle("warn", Boolean(mine && lease.asked));
    const operates = Boolean(me && me.role !== "watch" && store.chosen);
    element("lease-take").hidden = !operates || Boolean(mine) || Boolean(lease && me && lease.by === me.session);
    element("lease-give").hidden = !mine;
    element("lease-keep").hidden = !(mine && lease.asked);
    element("lease-give").textContent = mine && lease.asked ? `Hand over to ${lease.asked}` : "Give up";
  };

  const logIn = async (words) => {
    const answer = await post("/api/login", words);
    element("password").value = "";
    if (!answer.ok) { say(answer.text, "bad"); return; }
    refusal = "";
    await recall();
  };
  element("login").onsubmit = (event) => {
    event.preventDefault();
    logIn({ user: element("user").value, password: element("password").value });
  };
  certificate.onclick = () => logIn({ certificate: true });
  element("logout").onclick = async () => {
    await post("/api/logout", {});
    location.reload();
  };
  element("lease-take").onclick = () => change("take");
  element("lease-give").onclick = () => change("hand over");
  element("lease-keep").onclick = () => change("keep");
  return { byLink, recall, draw, choose: draw };
}

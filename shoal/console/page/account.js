// Who I am, a login with a password, and who commands the chosen vehicle.
import { ask, failed, page, post, say, store, write, writeAnswer } from "./page.js";

const LOG_IN = "Log in: open the link that `shoal console` or `shoal run` has printed.";

let me = null; // session, user and role
let refusal = ""; // of the last login
const certificate = page.loginCertificate;
const take = page.leaseTake, give = page.leaseGive, keep = page.leaseKeep;

async function byLink() {
  const token = location.hash.slice(1);
  if (!token) return;
  history.replaceState(null, "", "/");
  await logIn({ token });
}

// Asks who this page is; without a session, how to log in. Whether there is a session.
async function recall() {
  const answer = await ask("me");
  me = answer.ok ? answer : null;
  write(page.me, me ? `${me.user} (${me.role})` : "");
  page.logout.hidden = !me;
  page.login.hidden = me !== null || !(answer.passwords || answer.certificate);
  certificate.hidden = !answer.certificate;
  write(certificate, `Log in as ${answer.certificate} by certificate`);
  if (me) { if (page.result.textContent.endsWith(LOG_IN)) say(""); return true; }
  if (answer.passwords !== undefined) say(refusal + LOG_IN, "bad");
  return false;
}

async function change(words) {
  const vehicle = store.chosen, { ok, text } = await post("lease", { vehicle, change: words });
  writeAnswer(page.result, { ok, text: `${vehicle}: ${text}` });
}

function draw() {
  const lease = store.leases[store.chosen];
  const mine = Boolean(me && lease?.session === me.session), wanted = mine && lease.asked;
  const asked = lease?.asked ? `; ${lease.asked} asks for it` : "";
  const holder = mine ? "you command" : `${lease?.user} commands`;
  write(page.lease, lease ? holder + asked : "nobody commands", wanted ? "warn" : "");
  write(page.leaseLeft, asked && `${lease.left} s left`);
  const operates = me && me.role !== "watch" && store.chosen;
  take.hidden = !operates || mine || lease?.by === me.session;
  give.hidden = !mine;
  keep.hidden = !wanted;
  give.textContent = wanted ? `Hand over to ${lease.asked}` : "Give up";
}

async function logIn(words) {
  const answer = await post("login", words);
  page.password.value = "";
  refusal = failed(answer) ? `${answer.text}. ` : "";
  if (!refusal) await recall();
}
page.login.onsubmit = () => logIn({ user: page.user.value, password: page.password.value });
certificate.onclick = () => logIn({ certificate: true });
page.logout.onclick = async () => {
  await post("logout");
  location.reload();
};
take.onclick = () => change("take");
give.onclick = () => change("hand over");
keep.onclick = () => change("keep");
export { byLink, recall, draw, draw as choose };

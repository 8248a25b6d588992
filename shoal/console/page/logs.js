// The logs of the vehicle, or below a folder: list, files, report.
import { ask, button, duration, fill, make, matches, page, post, postJob, small, write } from "./page.js";

const PATIENCE = 60000; // ms for a list of many logs

const cancel = page.reportCancel, filter = page.logsFilter;
const drawn = new Set(); // keys of the logs that have a report
let logs = [];
const tell = (text, kind) => write(page.logsNote, text, kind);

async function refresh() {
  tell("reading");
  const answer = await ask("logs", {}, PATIENCE);
  if (!answer.ok) return tell(answer.text, "bad");
  ({ logs } = answer);
  tell(`${logs.length} log${logs.length === 1 ? "" : "s"}, the newest first`);
  drawList();
}

function drawList() {
  fill(page.logs, logs.filter(({ name, system }) => matches(filter, name, system)).map(line));
}

function line(log) {
  const { key, name, system, seconds, bytes, problem } = log;
  const title = [name, small(`${system}${seconds === null ? "" : `, ${duration(seconds)}`}, ${size(bytes)}`)];
  if (problem) title.push(small(problem, "bad"));
  const files = log.files.map((file) => make("div", make("a", `${file.name} (${size(file.bytes)})`,
    { href: `/api/log-file?${new URLSearchParams({ log: key, file: file.name })}`, download: "" })));
  const report = button("Report", () => makeReport(log, report));
  const item = make("li", [make("span", title), report, make("details", [make("summary", "Files"), ...files])]);
  if (drawn.has(key)) item.append(reportLink(key, "Open the report"));
  return item;
}

// Browsers open another page only while they handle a press: hence the link.
async function makeReport({ key, name }, pressed) {
  tell(`making the report of ${name}`);
  const answer = await postJob("log-report-make", { log: key }, pressed, cancel);
  if (!answer.ok) return tell(`${name}: ${answer.text}`, "bad");
  drawn.add(key);
  tell("", "good");
  page.logsNote.append(reportLink(key, `Open the report of ${name}`));
}

const reportLink = (log, text) =>
  make("a", text, { href: `/api/log-report?${new URLSearchParams({ log })}`, target: "_blank", rel: "noopener" });

page.logsRefresh.onclick = refresh;
filter.oninput = drawList;
cancel.onclick = () => post("log-report-cancel");
export { refresh as open };

const size = (bytes) => `${(bytes / 1e6).toFixed(2)} MB`;

// The logs of the vehicle, or below a folder: list, files, report.
import { ask, element, make, post } from "./page.js";

const PATIENCE = 60000; // ms for a list of many logs

export function makeLogs() {
  const note = element("logs-note"), cancel = element("report-cancel");
  const drawn = new Set(); // keys of the logs that have a report
  let rows = [];

  const tell = (text, kind = "") => { note.textContent = text; note.className = kind; };

  const refresh = async () => {
    tell("reading");
    const answer = await ask("/api/logs", {}, PATIENCE);
    if (!answer.ok) { tell(answer.text, "bad"); return; }
    rows = answer.logs.map((log) => ({ words: `${log.name} ${log.system}`.toLowerCase(), item: line(log) }));
    tell(`${rows.length} log${rows.length === 1 ? "" : "s"}, the newest first`);
    drawList();
  };

  const drawList = () => {
    const words = element("logs-filter").value.toLowerCase();
    element("logs").replaceChildren(...rows.filter((row) => row.words.includes(words)).map(({ item }) => item));
  };

  const line = (log) => {
    const item = make("li"), name = make("span", log.name), report = make("button", "Report"), files = make("details");
    const length = log.seconds === null ? "" : `, ${duration(log.seconds)}`;
    name.append(make("small", `${log.system}${length}, ${size(log.bytes)}`));
    if (log.problem) name.append(make("small", log.problem, { className: "bad" }));
    files.append(make("summary", "Files"), ...log.files.map((file) => {
      const words = new URLSearchParams({ log: log.key, file: file.name });
      const line = make("div");
      line.append(make("a", `${file.name} (${size(file.bytes)})`, { href: `/api/log-file?${words}`, download: "" }));
      return line;
    }));
    report.onclick = () => makeReport(log, report);
    item.append(name, report, files);
    if (drawn.has(log.key)) item.append(reportLink(log, "Open the report"));
    return item;
  };

  // The browser lets a page open another one only while it handles a press: the report is a link when it is made.
  const makeReport = async (log, button) => {
    tell(`drawing ${log.name}`);
    cancel.hidden = false;
    button.disabled = true;
    const answer = await post("/api/log-report-make", { log: log.key });
    button.disabled = false;
    cancel.hidden = true;
    if (!answer.ok) { tell(`${log.name}: ${answer.text}`, "bad"); return; }
    tell("", "good");
    drawn.add(log.key);
    note.append(reportLink(log, `Open the report of ${log.name}`));
  };

  const reportLink = (log, text) =>
    make("a", text, { href: `/api/log-report?${new URLSearchParams({ log: log.key })}`, target: "_blank", rel: "noopener" });

  element("logs-refresh").onclick = refresh;
  element("logs-filter").oninput = drawList;
  cancel.onclick = () => post("/api/log-report-cancel", {});
  return { draw: () => {}, open: refresh };
}

function size(bytes) {
  if (bytes < 1e6) return `${(bytes / 1e3).toFixed(0)} kB`;
  return bytes < 1e9 ? `${(bytes / 1e6).toFixed(1)} MB` : `${(bytes / 1e9).toFixed(2)} GB`;
}

function duration(seconds) {
  return seconds < 120 ? `${seconds.toFixed(0)} s` : `${(seconds / 60).toFixed(0)} min`;
}

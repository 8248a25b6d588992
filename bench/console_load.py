"""Time until the page of a vehicle can be used: `python bench/console_load.py [--loads N]`, with Chromium.

README's first command runs a vehicle. Its page is opened N times without anything that the browser has kept; each time
counts from the navigation until the vehicle is drawn on the map and *Abort* can be pressed. Prints the first, the
shortest and the median time (s), and the processor time of the browser's page; exits with 1 if the shortest is above
1 s: other programs of a busy computer make the others longer.
"""

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.outside import until
from tests.shoal.console.browser import Browser, browser
from tests.shoal.console.operator_page import LINK

COMMAND = "run", "lauv-noptilus-1", "-p", "Simulation", "--bus", "zenoh"
MOST = 1.0  # s
SETTLING = 20.0  # s
WATCH = """
(() => {
  const look = () => {
    const arrow = document.querySelector("#map .arrow")?.getBoundingClientRect();
    const abort = document.getElementById("abort");
    const isUsable = arrow?.width && abort?.onclick && abort.offsetParent && !abort.disabled
      && document.getElementById("vehicle").value;
    if (isUsable) window.usable = performance.now(); else setTimeout(look, 5);
  };
  look();
})()
"""


def load(page: Browser, address: str) -> tuple[float, float]:
    """Seconds from the navigation until the page can be used, and seconds of processor time of its tasks."""
    page.call("Page.navigate", url="about:blank")
    page.call("Network.clearBrowserCache")
    page.call("Page.navigate", url=address)
    milliseconds = until(lambda: page.run("window.usable"), 60.0)
    metrics = {each["name"]: each["value"] for each in page.call("Performance.getMetrics")["metrics"]}
    return milliseconds / 1000.0, metrics["TaskDuration"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--loads", type=int, default=20)
    loads = parser.parse_args().loads
    with tempfile.TemporaryDirectory() as name:
        command = [sys.executable, "-m", "shoal.cli", *COMMAND, "--set", "Transports.Console:Port=0"]
        words = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        (Path(name) / "vehicle").mkdir()
        with subprocess.Popen(command, cwd=Path(name) / "vehicle", **words) as process:
            try:
                assert process.stdout is not None
                link = next(found for line in process.stdout if (found := LINK.match(line)))
                time.sleep(SETTLING)
                with browser(Path(name) / "browser") as page:
                    page.set_size(1280, 800)
                    page.call("Performance.enable")
                    page.call("Page.addScriptToEvaluateOnNewDocument", source=WATCH)
                    found = [load(page, link[1])]
                    found += [load(page, link[1].partition("#")[0]) for _ in range(loads)]
            finally:
                process.terminate()
    times, spent = [time for time, _ in found], [spent for _, spent in found]
    print(f"usable, first load with the login: {times[0]:.2f} s")
    print(f"usable, median of {loads}: {statistics.median(times[1:]):.2f} s")
    print(f"usable, shortest: {min(times[1:]):.2f} s (at most {MOST:g})")
    print(f"processor time of the page, median: {statistics.median(spent[1:]):.2f} s")
    return int(min(times[1:]) > MOST)


if __name__ == "__main__":
    sys.exit(main())

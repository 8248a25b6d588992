"""A session that asks each route of a vehicle's page a thousand times: all routes that the application has."""

import asyncio
import http.client
import json
import re
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlencode

import numpy as np
import pytest

import imc
from shoal.console import ConsoleServer
from shoal.network import Network
from tests.outside import until
from tests.repeats import all_but
from tests.shoal.console.operator_page import OperatorPage, frame_of, vehicle_page
from tests.shoal.console.page_routes import routes_of

NAME = "lauv-noptilus-1"
NUMBER = 1000
LONGEST = 4.0  # s in which a route is asked again: some answers wait for the vehicle, or for a process
LEAST_SHARE = 0.9  # of the calls that a task makes at its rate
MOST_GROWTH = 20.0  # MB
WORDS = {
    "vehicle": NAME,
    "entity": "Depth Sensor",
    "plan": "east",
    "profile": NAME,
    "text": "plan: east\nmaneuvers:\n- goto: {lat: 41.185°, lon: -8.7°, depth: 0, speed: 1 m/s}\n",
    "name": "east.yaml",
    "suffix": ".plan",
    "shapes": [],
    "change": "take",
    "order": "put",
}
COSTLY = ("GET", "/api/limits"), ("POST", "/api/checks"), ("POST", "/api/order")
PLACES = {"{name}": "page.js", "{zoom}": "1", "{column}": "0", "{row}": "0"}

pytestmark = pytest.mark.heavy


async def all_routes() -> list[tuple[str, str]]:
    async with Network([]) as network:
        server = ConsoleServer(network)
        server._socket.close()
        return routes_of(server)


ROUTES = asyncio.run(all_routes())


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[OperatorPage]:
    folder = tmp_path_factory.mktemp("vehicle")
    options = ("Transports.Console:Forecast=true", "Transports.Logging:Flush Interval=0.2")
    options += ("Transports.Logging:LSF Compression Method=none",)
    words = [word for option in options for word in ("--set", option)]
    with vehicle_page(folder, *words, "--clock", "1x") as found:
        found.log_in()
        found.folder = folder
        until(lambda: NAME in frame_of(found)["vehicles"], 40.0)
        found.log = until(lambda: found.get("/api/logs")["logs"], 40.0, every=1.0)[0]["key"]
        yield found


def flood(page: OperatorPage, method: str, path: str, number: int) -> Counter[int]:
    """Statuses of so many requests over one connection of the session, or of fewer if they take long."""
    connection = http.client.HTTPConnection("127.0.0.1", page.port, timeout=60)
    headers = {"Origin": f"http://{page.host}", "Cookie": page.cookie}
    words = {**WORDS, "log": page.log, "file": "Config.ini"}
    for place, value in PLACES.items():
        path = path.replace(place, value)
    query = f"{path}?{urlencode({name: word for name, word in words.items() if isinstance(word, str)})}"
    found: Counter[int] = Counter()
    end = time.monotonic() + LONGEST
    while found.total() < number and time.monotonic() < end:
        connection.request(method, query, json.dumps(words) if method == "POST" else None, headers)
        answer = connection.getresponse()
        answer.read()
        found[answer.status] += 1
    connection.close()
    return found


def resident(page: OperatorPage) -> float:
    """Memory of the vehicle's process (MB)."""
    return int(re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{page.process.pid}/status").read_text())[1]) / 1024


def depths(page: OperatorPage) -> np.ndarray:
    """Time stamps (s) of the depth sensor, at 10 Hz, in the log of the vehicle as it is now."""
    (path,) = page.folder.glob("log/*/*/*/Data.lsf*")
    return np.sort(imc.Log(path).array("Depth")["timestamp"])


@pytest.mark.parametrize(("method", "path"), all_but(COSTLY, [each for each in ROUTES if each[1] != "/api/logout"]))
def test_a_thousand_requests_slow_no_vehicle_and_keep_no_memory(page: OperatorPage, method: str, path: str) -> None:
    time.sleep(1.0)  # the session may ask again
    flood(page, method, path, 1)
    page.request("POST", "/api/lease", {"vehicle": NAME, "change": "hand over"})
    before, began = resident(page), depths(page)[-1]
    found = flood(page, method, path, NUMBER)
    assert all(status in (200, 204, 206) or 400 <= status < 500 for status in found), found
    assert resident(page) - before < MOST_GROWTH, found
    times = depths(page)
    during = times[times > began]
    assert len(during) > LEAST_SHARE * 10.0 * (during[-1] - during[0]), found
    assert page.order(NAME, "abort")["text"]

"""Time of MAVSDK to list all parameters of a shipped vehicle, and load of the list on a radio.

`python bench/mavlink_parameters.py [--profile lauv-noptilus-1] [--repeat 5]` prints the times in s on loopback and at a
loss of 5 % each way, and the share of a serial line of 57.6 kBd, alone and with the telemetry beside it.
"""

import argparse
import asyncio
import os
import pty
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from mavlink import StreamSplitter, encode, load_dialect
from shoal.missions import prepare
from tests.outside import free_port
from tests.tasks.transports.lossy import Lossy

BAUD = 57600
DIALECT = load_dialect()
PATIENCE = 60.0  # s


async def list_all(port: int) -> None:
    """Print how many parameters MAVSDK has listed, and how long it took."""
    from mavsdk.asyncio.mavsdk import Mavsdk
    from mavsdk.asyncio.plugins.param import ParamAsync
    from mavsdk.component_type import ComponentType
    from mavsdk.mavsdk import Configuration

    configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    async with Mavsdk(configuration) as sdk:
        await sdk.add_any_connection(f"udpin://127.0.0.1:{port}")
        parameters = ParamAsync(await sdk.first_autopilot(15.0))
        began = time.monotonic()
        found = await parameters.get_all_params()
        passed = time.monotonic() - began
        print(len(found.int_params) + len(found.float_params), passed, flush=True)


@contextmanager
def afloat(profile: str, link: str) -> Iterator[None]:
    """A vehicle in real time, with one link."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        how = {"clock": "1x", "log_root": place / "log", "state_folder": place / "db"}
        vehicle = prepare(profile, overrides=[f"Transports.MAVLink:Links={link}"], **how).vehicle
        vehicle.start()
        thread = threading.Thread(target=vehicle.run, daemon=True)
        thread.start()
        try:
            yield
        finally:
            vehicle.kernel.post(vehicle.stop)
            thread.join(PATIENCE)
            vehicle.close()


def by_mavsdk(profile: str, loss: float, seed: int) -> tuple[int, float]:
    """Number of parameters, and duration in s."""
    port = free_port()
    with Lossy(port, loss=loss, seed=seed) as line, afloat(profile, f"udpout://127.0.0.1:{line.port}?flavor=px4"):
        command = [sys.executable, __file__, "--client", str(port)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=True)
    count, seconds = done.stdout.split()
    return int(count), float(seconds)


def on_a_line(profile: str) -> tuple[int, float, float, float]:
    """Parameters, s for them, and the shares of the line that they and everything took meanwhile."""
    end, own = pty.openpty()
    tty.setraw(own)
    request = DIALECT.by_name["PARAM_REQUEST_LIST"]
    splitter, sizes, seen = StreamSplitter(DIALECT), {"PARAM_VALUE": 0}, set[int]()
    with afloat(profile, f"serial://{os.ttyname(own)}?baud={BAUD}"):
        time.sleep(3.0)
        os.set_blocking(end, False)
        while True:  # what has been sent meanwhile
            try:
                os.read(end, 65536)
            except BlockingIOError:
                break
        os.set_blocking(end, True)
        began, total, count = time.monotonic(), 0, 1
        os.write(end, encode(request, request.pack({"target_system": 0, "target_component": 0}), 0, 255, 190))
        while len(seen) < count:
            data = os.read(end, 4096)
            total += len(data)
            for message in splitter.feed(data)[0]:
                if message.name == "PARAM_VALUE":
                    seen.add(message.values["param_index"])
                    count = message.values["param_count"]
                    sizes["PARAM_VALUE"] += 12 + len(message.payload.rstrip(b"\0"))
        passed = time.monotonic() - began
    os.close(end)
    os.close(own)
    carried = passed * BAUD / 10.0
    return count, passed, sizes["PARAM_VALUE"] / carried, total / carried


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--profile", default="lauv-noptilus-1")
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--client", type=int)
    options = parser.parse_args()
    if options.client:
        asyncio.run(list_all(options.client))
        return
    for loss in (0.0, 0.05):
        found = [by_mavsdk(options.profile, loss, seed) for seed in range(1, options.repeat + 1)]
        times = sorted(seconds for _, seconds in found)
        counts = " or ".join(map(str, sorted({count for count, _ in found})))
        print(
            f"{counts} parameters by MAVSDK, {100 * loss:g} % lost: median {statistics.median(times):.2f} s, "
            f"{times[0]:.2f} to {times[-1]:.2f} s",
            flush=True,
        )
    count, passed, own, total = on_a_line(options.profile)
    shares = f"{100 * own:.0f} % of the line, with telemetry {100 * total:.0f} %"
    print(f"{count} parameters on {BAUD} baud: {passed:.2f} s, {shares}")
    print("load", *os.getloadavg())


if __name__ == "__main__":
    main()

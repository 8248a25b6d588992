"""Run in a network namespace of its own: two vehicles, and an operator who commands them over a bad radio.

Argument: a folder. Prints one JSON object with what the operator's commands said.
"""

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from tests.shoal.network.radio import Quality
from tests.shoal.network.stations import Stations, stations

BAD = Quality(loss=0.2, delay=0.2, jitter=0.1, double=0.05)
CUT = 60.0  # s; longer than all time-outs of vehicle and console
VEHICLES = {1: "lauv-noptilus-1", 2: "otter"}
OPERATOR = 3
PLAN = "plan: far\norigin: 41.185°, -8.7062°\nspeed: 1 m/s\nmaneuvers:\n" + "".join(
    f"  - goto: {{north: {10 * n}, east: {5 * n}, depth: 0}}\n" for n in range(1, 40)
)
PARAMETER = "Path Control:Corridor -- Width"
SHOAL = [sys.executable, "-m", "shoal.cli"]


def command(net: Stations, *words: str, patience: float = 60.0) -> dict[str, Any]:
    """Run a command of the operator."""
    began = time.monotonic()
    done = subprocess.run(
        [*net.enter(OPERATOR), *SHOAL, *words, "--connect", "imc+udp://0.0.0.0/"],
        capture_output=True, text=True, timeout=patience,
    )  # fmt: skip
    return {
        "status": done.returncode,
        "out": done.stdout,
        "err": done.stderr,
        "seconds": round(time.monotonic() - began, 1),
    }


def until_heard(net: Stations, names: list[str], patience: float) -> float:
    """Seconds until the operator sees these vehicles, alive."""
    began = time.monotonic()
    while time.monotonic() - began < patience:
        seen = command(net, "ls", "--json")["out"]
        if all(f'"{name}"' in seen for name in names):
            return round(time.monotonic() - began, 1)
    return patience


def scene(folder: Path) -> dict[str, Any]:
    (folder / "far.yaml").write_text(PLAN)
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    found: dict[str, Any] = {}
    with stations(3) as net:
        vehicles: list[subprocess.Popen[bytes]] = []
        try:
            for number, name in VEHICLES.items():
                words = ["run", name, "-p", "Simulation", "--log-dir", str(folder / "log")]
                words += ["--set", f"General:Network Address={net.address(number)}"]
                words += ["--set", "Plan.Autostart:Enabled=Never"] if name == "lauv-noptilus-1" else []
                output = (folder / f"{name}.txt").open("wb")
                vehicles.append(
                    subprocess.Popen([*net.enter(number), *SHOAL, *words], stdout=output, stderr=subprocess.STDOUT)
                )
            found["good"] = until_heard(net, list(VEHICLES.values()), 30.0)
            net.change(BAD)
            found["ls"] = command(net, "ls", "--json")
            found["put"] = [command(net, "plan", name, "put", str(folder / "far.yaml")) for name in VEHICLES.values()]
            found["list"] = [command(net, "plan", name, "list") for name in VEHICLES.values()]
            found["start"] = [command(net, "plan", name, "start", "far", "--no-wait") for name in VEHICLES.values()]
            found["status"] = [command(net, "plan", name, "status", "--json") for name in VEHICLES.values()]
            for number, name in enumerate(VEHICLES.values()):
                found.setdefault("get", []).append(command(net, "param", name, "get", PARAMETER))
                found.setdefault("set", []).append(command(net, "param", name, "set", f"{PARAMETER}={number + 2}"))
            net.change(Quality(cut=True))
            found["cut"] = command(net, "plan", "otter", "status")
            time.sleep(max(0.0, CUT - found["cut"]["seconds"]))
            net.change(Quality())
            found["again"] = until_heard(net, list(VEHICLES.values()), 30.0)
            found["stop"] = [command(net, "plan", name, "stop") for name in VEHICLES.values()]
            found["alive"] = [vehicle.poll() is None for vehicle in vehicles]
        finally:
            for vehicle in vehicles:
                vehicle.terminate()
            for vehicle in vehicles:
                try:
                    vehicle.wait(20.0)
                except subprocess.TimeoutExpired:
                    vehicle.kill()
                    vehicle.wait()
    return found


if __name__ == "__main__":
    print(json.dumps(scene(Path(sys.argv[1]))))

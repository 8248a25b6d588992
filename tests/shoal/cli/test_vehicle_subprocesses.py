"""A shipped vehicle in several processes, started and kept by the main one."""

import json
import os
import signal
import sys
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

import imc
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from tests.outside import children, slowness
from tests.runtime.zenoh.processes import Network, Process
from tests.runtime.zenoh.vehicles import NAME, SYSTEM, Vehicle, wait_until

CAMERA = "MUG Camera"
STAYS = ("--set", "Plan.Autostart:Enabled=Never")  # above its glider, which it would see again once in each circle only
VISION = ("--set", "Simulators.MUGDetectionCamera:Process=vision", *STAYS)
State = imc.EntityState.State


def camera_id() -> int:
    """The id that the camera has if one process runs all tasks."""
    made = build(load_profile(NAME), {"Simulation"}, clock=VirtualClock(0))
    entity = made.vehicle.entities.find(CAMERA)
    made.vehicle.close()
    assert entity is not None
    return entity.id


def token(process: str) -> str:
    return f"imc/{NAME}/@alive/{SYSTEM:04x}/{process}"


def parameters(asker: Process, label: str) -> Any:
    request = {"abbrev": "QueryEntityParameters", "src": 0x4001, "dst": SYSTEM, "name": label}
    return asker.ask(f"get imc/{NAME}/@q/QueryEntityParameters {json.dumps(request)}")["replies"]


@pytest.mark.heavy
def test_a_process_of_a_vehicle_is_started_killed_and_started_again(network: Network, tmp_path: Path) -> None:
    main = Vehicle(network, tmp_path, *VISION)
    wait_until(main.swims, main)
    asker = network.asker()
    assert asker.line() == {"opened": True}
    watcher = network.asker()
    assert watcher.line() == {"opened": True}
    watcher.ask(f"watch imc/{NAME}/@alive/**")
    watcher.line_where(token=token("vision"), born=True)
    wait_until(lambda: parameters(asker, CAMERA), main)
    assert parameters(asker, CAMERA)[0]["name"] == CAMERA
    assert len(parameters(asker, "Daemon")) == 1, "one of the two processes answers"
    state = f"get imc/{NAME}/@q/EntityState/MUG_Camera"
    asker.until(lambda answer: "state=1" in answer["replies"][0]["text"], state)
    assert "starts" not in asker.ask(state)["replies"][0]["text"], "what the main process has said before"
    (listed,) = asker.ask(f"late imc/{NAME}/EntityList/* 0.5")["heard"]
    assert f"{CAMERA}={camera_id()}" in listed["list"].split(";")

    (vision,) = children(main.popen.pid)
    killed = time.monotonic()
    os.kill(vision, signal.SIGKILL)
    watcher.line_where(token=token("vision"), born=False)
    assert time.monotonic() - killed < 1.0 * slowness()
    watcher.line_where(token=token("vision"), born=True)
    wait_until(lambda: asker.ask(f"late imc/{NAME}/EstimatedMugState/* 0.5")["heard"], main)
    (vision,) = children(main.popen.pid)
    os.kill(vision, signal.SIGTERM)  # as systemd does: to all of a service
    main.popen.send_signal(signal.SIGTERM)
    assert main.popen.wait(20) == 0, main.errors
    watcher.line_where(token=token("vision"), born=False)
    wait_until(lambda: not Path(f"/proc/{vision}").exists(), main)

    messages = main.messages()
    states = [m for m in messages if isinstance(m, imc.EntityState) and m.src_ent == camera_id()]
    seen = [state for before, state in pairwise([None, *states]) if before is None or state.state != before.state]
    steps = [state.state for state in seen]
    assert steps == [State.BOOT, State.NORMAL, State.FAILURE, State.BOOT, State.NORMAL]
    assert seen[2].description == "process vision has ended"
    assert any(isinstance(m, imc.EstimatedMugState) and m.src_ent == camera_id() for m in messages)
    beats = [m.timestamp for m in messages if isinstance(m, imc.Heartbeat) and m.src_ent == 0]
    assert len(beats) <= beats[-1] - beats[0] + 2, "one heartbeat a second, whatever the number of processes"
    texts = [m.text for m in messages if isinstance(m, imc.LogBookEntry)]
    assert any("was killed by signal 9" in text for text in texts)
    assert not any("another process publishes" in text for text in texts)
    assert texts.count("process vision has ended") == 1, "an ordered end is no failure"


TASKS = """
import numpy as np
import imc
from runtime import Frame, State, Task, consume, periodic

class Camera(Task):
    def start(self):
        self.count = 0
        self.set_entity_state(State.NORMAL, "active")

    @periodic(20.0)
    def take(self):
        self.count += 1
        image = np.full((SIZE, 96, 4), self.count % 256, np.uint8)
        self.publish_frame(Frame(self.now, "Front", self.count, image, {"fov": 1.5}))

class Viewer(Task):
    @consume
    def look(self, frame: Frame):
        same = bool((frame.image == frame.index % 256).all())
        self.publish(imc.Depth(value=frame.index if same and frame.image.shape == (SIZE, 96, 4) else -1.0))
"""

PROFILE = """
[General]
Vehicle = lauv-test-2
Bus = zenoh

[Zenoh]
Local Port = {0}
Scouting = none

[pictures.Camera]
Enabled = Always
Process = vision

[pictures.Viewer]
Enabled = Always

[Transports.Logging]
Enabled = Always
"""


# Debian's limit for users; root would not be bound by it.
LIMITED = """import os, resource, sys
resource.setrlimit(resource.RLIMIT_MEMLOCK, (int(sys.argv[1]), int(sys.argv[1])))
unbound = ["setpriv", "--bounding-set", "-ipc_lock"] if os.geteuid() == 0 else []
os.execvp((unbound or sys.argv[2:])[0], unbound + sys.argv[2:])"""


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("rows", "limit", "told"),
    [
        (64, "unlimited", ""),
        (12_000, "8388608", "frames go to other processes without shared memory, which is slower: 26.4 MB are needed"),
        (64, "0", "zenoh: no shared memory, since this process may lock 0 MB of memory"),
    ],
)
def test_frames_reach_the_tasks_of_another_process(
    network: Network, tmp_path: Path, rows: int, limit: str, told: str
) -> None:
    (tmp_path / "pictures.py").write_text(f"SIZE = {rows}\n{TASKS}")
    profile = tmp_path / "lauv-test-2.ini"
    profile.write_text(PROFILE.format(network.local_port))
    command = ["-m", "shoal.cli", "run", profile, "--code", tmp_path, "--log-dir", tmp_path / "log", "--for", "8s"]
    run = network.add(*(["-c", LIMITED, limit, sys.executable] if limit != "unlimited" else []), *command)
    assert run.popen.wait(40) == 0, run.errors
    (log,) = tmp_path.rglob("Data.lsf*")
    messages = list(imc.Log(log.parent))
    texts = [m.text for m in messages if isinstance(m, imc.LogBookEntry) and m.text.startswith(told)]
    assert not told or 1 <= len(texts) <= 2, texts  # each process says it once
    shown = [m.value for m in messages if isinstance(m, imc.Depth)]
    assert len(shown) > 20, run.errors
    assert shown == sorted(set(shown))
    assert min(shown) > 0

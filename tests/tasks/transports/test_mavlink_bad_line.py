"""MAVSDK and MAVProxy command shipped vehicles over a line that loses 5 % of all datagrams each way."""

import contextlib
import json
import math
import subprocess
import sys
import threading
from pathlib import Path

import pytest

import imc
from shoal.missions import prepare
from tests.outside import ALONE, free_port, until
from tests.repeats import all_but
from tests.tasks.transports.lossy import Lossy
from tests.tasks.transports.mavproxy import MAVProxy

PATIENCE = 120.0
LOSS = 0.05
AUV, BOAT, MULTIROTOR = (
    ("lauv-noptilus-1", "submarine", "10x"),
    ("otter", "boat", "10x"),
    ("hexa-00", "hexacopter", "4x"),
)
FAR_AWAY = {"submarine": (1.2, -3.0), "boat": (1.2, 0.0), "hexacopter": (5.0, 12.0)}
SETTLING = 15.0  # s in which an AUV reaches its circle, and an aircraft stops and comes back


class Watched:
    """A vehicle in a thread of its own, its true states, and the plans that were started, with the states before."""

    def __init__(self, vehicle):
        self.vehicle = vehicle
        self.truths, self.plans = [], []
        vehicle.observe(imc.SimulatedState, self.truths.append)
        vehicle.observe(imc.PlanControl, self.note)

    def note(self, message):
        asked = message.type == imc.PlanControl.Type.REQUEST and message.op == imc.PlanControl.Op.START
        if asked and self.plans and self.plans[-1][1] == message.plan_id:
            self.plans.pop()  # a console whose order was lost, or late, has repeated it: that one counts
        if asked:
            self.plans.append((len(self.truths), message.plan_id))

    def wait_near(self, north, east, meters):
        """Wait until it is near a place (m) from where it began."""
        first = self.truths[0]
        until(
            lambda: math.hypot(self.truths[-1].x - first.x - north, self.truths[-1].y - first.y - east) < meters,
            PATIENCE,
            told=lambda: f"{self.truths[-1]} of {first}",
        )

    def wait_for(self, seconds):
        """Wait until so much of its time has passed."""
        begin = self.truths[-1].timestamp
        until(lambda: self.truths[-1].timestamp > begin + seconds, PATIENCE)

    def while_(self, name):
        """The true states from the first start of a plan until that of the next one."""
        begin = next(number for number, (_, plan) in enumerate(self.plans) if plan == name)
        return self.truths[self.plans[begin][0] : self.plans[begin + 1][0]]

    def check_hold(self):
        """It was within 5 m of where it was told to hold, and within 1 m of that level: a barometer drifts."""
        truths = self.while_("hold")
        here, end = truths[0], truths[-1].timestamp
        stayed = [truth for truth in truths if truth.timestamp >= here.timestamp + SETTLING]
        assert end - stayed[0].timestamp >= 60.0
        assert max(math.hypot(truth.x - here.x, truth.y - here.y) for truth in stayed) < 5.0
        assert max(abs(truth.z - here.z) for truth in stayed) < 1.0


@contextlib.contextmanager
def afloat(profile, clock, flavor, folder):
    """A shipped vehicle, and the port at which a station hears it over a bad line."""
    port = free_port()
    with Lossy(port, loss=LOSS) as line:
        links = f"Transports.MAVLink:Links=udpout://127.0.0.1:{line.port}?flavor={flavor}"
        alone = [setting for setting in ALONE if "MAVLink" not in setting]
        overrides = [links, "Plan.Autostart:Enabled=Never", *alone]
        made = prepare(profile, clock=clock, overrides=overrides, log_root=folder, state_folder=folder / "db")
        watched = Watched(made.vehicle)
        made.vehicle.start()
        thread = threading.Thread(target=made.vehicle.run, daemon=True)
        thread.start()
        try:
            yield watched, port
        finally:
            made.vehicle.kernel.post(made.vehicle.stop)
            thread.join(PATIENCE)
            made.vehicle.close()
        assert line.trouble.lost > 0.02 * line.trouble.sent > 5


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("profile", "kind", "clock"),
    all_but([AUV], [AUV, BOAT, MULTIROTOR]),
)
def test_mavsdk_flies_a_mission_and_gives_orders(profile, kind, clock, tmp_path):
    with afloat(profile, clock, "px4", tmp_path) as (watched, port):
        client = Path(__file__).with_name("mavsdk_mission_client.py")
        command = [sys.executable, str(client), str(port), kind]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.stdout, done.stderr
    seen = json.loads(done.stdout)
    speed, altitude = FAR_AWAY[kind]
    assert seen["place"] == pytest.approx([41.185, -8.7062], abs=1e-3)
    assert seen["parameters"] > 150
    assert "INVALID" in seen["refused"] or "UNSUPPORTED" in seen["refused"]
    for item in seen["downloaded"]:
        assert item == pytest.approx([60 / 111_100.0, altitude, speed], abs=1e-6)
    assert (seen["mission"], seen["paused"], seen["continued"]) == ("MISSION", "HOLD", "MISSION")
    watched.check_hold()
    assert (seen["finished"], seen["held"], seen["returning"]) == (True, "HOLD", "RETURN_TO_LAUNCH")
    assert seen["there"] == pytest.approx(altitude, abs=2.0)
    if kind == "submarine":
        assert seen["home"] == pytest.approx(0.0, abs=0.5), "it comes home to the surface"
    if kind == "hexacopter":
        assert (seen["taken_off"], seen["landing"]) == ("TAKEOFF", "LAND")
    assert seen["cleared"] == 0


STAY = {"submarine": "POSHOLD", "boat": "LOITER", "hexacopter": "LOITER"}
RETURN = {"submarine": "SURFACE", "boat": "RTL", "hexacopter": "RTL"}
HOME = (41.185, -8.7062)
WAYPOINT = "{number}\t0\t{frame}\t16\t0\t0\t0\t0\t{lat:.7f}\t{lon:.7f}\t{altitude}\t1\n"


def waypoints(path, altitude):
    """A file of MAVProxy: home, 60 m north, then 40 m east."""
    places = [(0, 0, 0, 0.0), (1, 60, 0, altitude), (2, 60, 40, altitude)]
    lines = [
        WAYPOINT.format(
            number=number,
            frame=3 if number else 0,
            lat=HOME[0] + north / 111_100.0,
            lon=HOME[1] + east / 83_800.0,
            altitude=up,
        )
        for number, north, east, up in places
    ]
    path.write_text("QGC WPL 110\n" + "".join(lines))
    return path


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("profile", "kind", "clock"),
    all_but([MULTIROTOR], [AUV, BOAT, MULTIROTOR]),
)
def test_mavproxy_flies_a_mission_and_gives_orders(profile, kind, clock, tmp_path):
    _, altitude = FAR_AWAY[kind]
    (tmp_path / "mavproxy").mkdir()
    with (
        afloat(profile, clock, "ardupilot", tmp_path) as (watched, port),
        MAVProxy(port, tmp_path / "mavproxy") as console,
    ):
        assert int(console.expect(r"Received (\d+) parameters").group(1)) > 150
        home = console.status("HOME_POSITION")
        assert [home["latitude"] / 1e7, home["longitude"] / 1e7] == pytest.approx(HOME, abs=1e-3)
        mission = waypoints(tmp_path / "mission.txt", altitude)
        # MAVProxy sends its last item once: if that is lost, its user has to load the file again.
        console.expect(r"MISSION_ACK: TYPE_MISSION: ACCEPTED", f"wp load {mission}")
        console.expect(rf"16 3 41\.1855\d+ -8\.7062\d* {altitude:.6f}", "wp list")
        console.expect(r"COMPONENT_ARM_DISARM: ACCEPTED", "arm throttle force")  # this computer may be busy
        console.expect(r"Mode AUTO", "mode AUTO")
        watched.wait_near(45, 0, 8)
        console.expect(rf"Mode {STAY[kind]}", f"mode {STAY[kind]}")
        watched.wait_for(80.0)
        console.expect(r"Mode AUTO", "mode AUTO")
        console.expect(r"mission_state : 5", "status MISSION_CURRENT")
        watched.check_hold()
        lat, lon = HOME[0] + 20 / 111_100.0, HOME[1] + 20 / 83_800.0
        console.expect(r"executing maneuver", f"guided {lat:.7f} {lon:.7f} {altitude}")
        watched.wait_near(20, 20, 12)
        console.expect(rf"Mode {RETURN[kind]}", f"mode {RETURN[kind]}")
        watched.wait_near(0, 0, 16)
        console.expect(r"MISSION_ACK: TYPE_MISSION: ACCEPTED", "wp clear")
        console.expect(r"Requesting 0 waypoints", "wp list")

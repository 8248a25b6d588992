"""Position targets: programs that send where the vehicle shall be, again and again."""

import json
import math
import subprocess
import sys
import threading
from pathlib import Path

import pytest

import imc
from imc import coordinates
from shoal.missions import prepare
from support import wgs84
from tests.outside import free_port
from tests.tasks.transports.test_mavlink_manual import Helmsman
from tests.tasks.transports.test_mavlink_vehicles import PATIENCE, commanded

POSITION_ONLY = 0xFF8
GUIDED = {"lauv-noptilus-1": 4, "otter": 15}


@pytest.fixture(params=GUIDED)
def flown(request, tmp_path):
    with commanded(request.param, tmp_path) as found:
        yield found


def away(flown):
    """How far the true vehicle is from home, north and east."""
    home, truth = flown.link.endpoint.model.home, flown.truths[-1]
    lat, lon, _ = coordinates.absolute_position(imc.EstimatedState(lat=truth.lat, lon=truth.lon, x=truth.x, y=truth.y))
    return wgs84.displacement(home.lat, home.lon, 0.0, lat, lon, 0.0)[:2]


@pytest.mark.heavy
def test_a_guided_vehicle_goes_where_the_last_target_is(flown):
    console = Helmsman(flown)
    target = dict(target_system=console.mine, coordinate_frame=1, type_mask=POSITION_ONLY)
    console.say("SET_POSITION_TARGET_LOCAL_NED", **target, x=60.0, y=0.0, z=0.0)
    flown.vehicle.run(2.0)
    assert flown.modes[-1] == "MANUAL", "nobody has chosen a mode for it"
    assert console.order(1, GUIDED[flown.profile]) == 0
    console.say("SET_POSITION_TARGET_LOCAL_NED", **target, x=60.0, y=0.0, z=0.0)
    flown.until(lambda: math.dist(away(flown), (60.0, 0.0)) < 25.0, 90.0)
    assert flown.modes[-1] == "OFFBOARD"
    assert math.dist(away(flown), (60.0, 0.0)) < 25.0
    console.say("SET_POSITION_TARGET_GLOBAL_INT", **(target | {"coordinate_frame": 6}), lat_int=2**31 - 1)
    console.say("SET_POSITION_TARGET_LOCAL_NED", **target, x=math.nan)
    console.say("SET_POSITION_TARGET_LOCAL_NED", **(target | {"type_mask": 0xFC7}), vx=1.0)
    console.say("SET_ATTITUDE_TARGET", target_system=console.mine, q=[0.0] * 4)
    console.say("SET_ATTITUDE_TARGET", target_system=console.mine, q=[1.0, 0.0, 0.0, 0.0], thrust=1.5)
    console.say("SET_ATTITUDE_TARGET", target_system=console.mine, q=[1.0, 0.0, 0.0, 0.0], type_mask=0x80)
    flown.vehicle.run(5.0)
    assert flown.modes[-1] == "OFFBOARD", "what cannot be followed changes nothing"
    console.heard("")
    assert console.order(1, 19 if flown.profile == "lauv-noptilus-1" else 0) == 0
    assert flown.modes[-1] == "MANUAL"


@pytest.mark.heavy
@pytest.mark.computing
def test_a_heading_and_a_thrust_are_followed_while_they_come(flown):
    """Starboard, then back; at the end of the stream the vehicle holds, although it is in guided."""
    console = Helmsman(flown)

    def steer(degrees, seconds, thrust=0.5):
        half = math.radians(degrees) / 2.0
        for _ in range(int(2 * seconds)):
            q = [math.cos(half), 0.0, 0.0, math.sin(half)]
            console.say("SET_ATTITUDE_TARGET", target_system=console.mine, type_mask=0x07, q=q, thrust=thrust)
            flown.vehicle.run(0.5)

    assert console.order(1, GUIDED[flown.profile]) == 0
    before = away(flown)
    steer(90.0, 40.0)
    turned = away(flown)
    assert turned[1] - before[1] > 15.0
    assert abs(turned[0] - before[0]) < 10.0
    assert flown.modes[-1] == "OFFBOARD"
    steer(-90.0, 40.0)
    assert away(flown)[1] < turned[1] - 8.0
    assert math.cos(flown.truths[-1].psi + math.pi / 2.0) > 0.9
    flown.vehicle.run(6.0)
    assert flown.modes[-1] == "HOLD"


@pytest.mark.heavy
@pytest.mark.computing
def test_the_end_of_a_stream_is_a_reason_to_hold(flown):
    console = Helmsman(flown, "px4")
    assert console.order(1, 6) == 1, "no target has come"
    target = dict(target_system=console.mine, coordinate_frame=1, type_mask=POSITION_ONLY, x=80.0)

    def stream(seconds):
        for _ in range(int(5 * seconds)):
            console.say("SET_POSITION_TARGET_LOCAL_NED", **target)
            flown.vehicle.run(0.2)

    stream(1.0)
    console.say("COMMAND_LONG", target_system=console.mine, command=176, param1=1, param2=6)
    stream(20.0)
    assert flown.modes[-1] == "OFFBOARD"
    assert away(flown)[0] > 8.0
    flown.vehicle.run(6.0)
    assert flown.modes[-1] == "HOLD"
    assert "No more targets: holding" in [words for _, words in flown.link.endpoint.model.notices]


@pytest.mark.heavy
def test_mavsdk_offboard(tmp_path):
    port = free_port()
    links = [f"Transports.MAVLink:Links=udpout:127.0.0.1:{port}:px4", "Plan.Autostart:Enabled=Never"]
    folders = {"log_root": tmp_path, "state_folder": tmp_path / "db"}
    vehicle = prepare("lauv-noptilus-1", clock="8x", overrides=links, **folders).vehicle
    vehicle.start()
    thread = threading.Thread(target=vehicle.run, daemon=True)
    thread.start()
    try:
        command = [sys.executable, str(Path(__file__).with_name("mavsdk_offboard_client.py")), str(port)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=2 * PATIENCE, check=False)
    finally:
        vehicle.kernel.post(vehicle.stop)
        thread.join(PATIENCE)
        vehicle.close()
    assert done.stdout, done.stderr
    seen = json.loads(done.stdout)
    assert (seen["mode"], seen["after"]) == ("OFFBOARD", "HOLD")
    assert seen["depth"] == pytest.approx(3.0, abs=1.5)

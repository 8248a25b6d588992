"""`shoal replay --mavlink` with unmodified clients: pymavlink, and MAVSDK."""

import contextlib
import json
import subprocess
import sys
import time
from pathlib import Path

import pytest
from pymavlink import mavutil

from tests.command import shoal
from tests.outside import free_port
from tests.tasks.transports.mavlink_playback import record

DUNE = Path(__file__).parents[2] / "data" / "logs" / "dune-mission-cut"
PATIENCE = 60.0
DENIED = 2


@contextlib.contextmanager
def replaying(log, *words):
    """A replay in a process of its own, and the port to which it sends."""
    port = free_port()
    link = f"udpout://127.0.0.1:{port}"
    command = [sys.executable, "-m", "shoal.cli", "replay", str(log), "--loop", "--link", link + words[0], *words[1:]]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield port
    finally:
        process.terminate()
        process.wait(PATIENCE)


def heard(station, name, where=lambda message: True):
    """The next message of a name, as pymavlink reads it."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        message = station.recv_match(type=name, blocking=True, timeout=1.0)
        if message is not None and where(message):
            return message
    raise AssertionError(f"no {name}")


@pytest.mark.heavy
def test_pymavlink_sees_a_log_of_dune_and_moves_the_replay():
    with replaying(DUNE, "?flavor=ardupilot", "--clock", "2x") as port:
        station = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}")
        with contextlib.closing(station):
            assert heard(station, "HEARTBEAT").type == mavutil.mavlink.MAV_TYPE_SUBMARINE
            assert station.target_system == 26
            station.mav.heartbeat_send(6, 8, 0, 0, 0)
            place = heard(station, "GLOBAL_POSITION_INT")
            assert (place.lat / 1e7, place.lon / 1e7) == (
                pytest.approx(41.185, abs=0.01),
                pytest.approx(-8.706, abs=0.01),
            )
            station.arducopter_arm()
            assert heard(station, "COMMAND_ACK").result == DENIED
            assert heard(station, "STATUSTEXT", lambda m: m.text.startswith("This is a replay"))
            before = heard(station, "SYSTEM_TIME")
            station.param_set_send("REPLAY_POSITION", 0.0)
            after = heard(station, "SYSTEM_TIME", lambda m: m.time_unix_usec < before.time_unix_usec)
            assert after.time_boot_ms > before.time_boot_ms


def test_stations_need_a_clock_that_they_can_follow():
    done = shoal("replay", str(DUNE), "--mavlink", "--clock", "virtual")
    assert (done.exit_code, "--clock real, or a factor" in done.output) == (2, True)


def test_a_link_that_is_none_is_refused():
    done = shoal("replay", str(DUNE), "--link", "carrier-pigeon://home")
    assert done.exit_code == 2
    assert "carrier-pigeon" in done.output


MAVSDK = """
import asyncio, json, sys
from mavsdk.asyncio.mavsdk import Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.component_type import ComponentType
from mavsdk.mavsdk import Configuration
from mavsdk.plugins.action import ActionError

async def first(stream, wanted=lambda value: True):
    async for value in stream:
        if wanted(value):
            return value

async def main():
    async with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as sdk:
        await sdk.add_any_connection(f"udpin://127.0.0.1:{sys.argv[1]}")
        system = await sdk.first_autopilot(30.0)
        telemetry, action, seen = TelemetryAsync(system), ActionAsync(system), {}
        seen["mode"] = (await first(telemetry.subscribe_flight_mode(), lambda mode: mode.name == "MISSION")).name
        seen["armed"] = await first(telemetry.subscribe_armed(), lambda armed: armed)
        seen["lat"] = (await first(telemetry.subscribe_position())).latitude_deg
        seen["roll"] = (await first(telemetry.subscribe_attitude_euler())).roll_deg
        seen["volts"] = (await first(telemetry.subscribe_battery())).voltage_v
        seen["home"] = (await first(telemetry.subscribe_home())).latitude_deg
        seen["items"] = len(await MissionRawAsync(system).download_mission())
        refused = []
        for order in (action.takeoff, action.return_to_launch, action.hold):
            try:
                await order()
            except ActionError as error:
                refused.append(str(error))
        seen["refused"] = refused
        print(json.dumps(seen))

asyncio.run(main())
"""


@pytest.mark.heavy
def test_mavsdk_sees_a_dive_and_may_command_nothing(tmp_path):
    log = record(tmp_path, "lauv-noptilus-1", 60.0)
    with replaying(log, "?flavor=px4", "--from", "10") as port:
        done = subprocess.run(
            [sys.executable, "-c", MAVSDK, str(port)], capture_output=True, text=True, timeout=2 * PATIENCE, check=False
        )
    assert done.returncode == 0, done.stderr
    seen = json.loads(next(line for line in done.stdout.splitlines() if line.startswith("{")))
    assert (seen["mode"], seen["armed"]) == ("MISSION", True)
    assert seen["lat"] == pytest.approx(seen["home"], abs=0.01)
    assert seen["volts"] > 20.0
    assert seen["items"] >= 1
    assert len(seen["refused"]) == 3
    assert all("DENIED" in text for text in seen["refused"]), seen["refused"]

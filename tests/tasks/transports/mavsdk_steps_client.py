"""A MAVSDK program that uses what a PX4 offers, step by step: port, kind of vehicle; prints the result of each as JSON.

A multirotor takes off first, and gets its mission in the air.
"""

import asyncio
import json
import math
import sys

from mavsdk.asyncio.mavsdk import Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.camera import CameraAsync
from mavsdk.asyncio.plugins.mission import MissionAsync
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.component_type import ComponentType
from mavsdk.mavsdk import Configuration
from mavsdk.plugins.action import ActionError
from mavsdk.plugins.mission import MissionItem, MissionPlan
from mavsdk.plugins.mission_raw import MissionItem as RawItem

NORTH, EAST = 1 / 111_100.0, 1 / 83_800.0  # degrees per m at 41.2 degrees
NAN = math.nan
PATIENCE = 120.0  # s for one step, also on a computer that is busy
SLOW = 1.2  # m/s: a mission is not over while such a computer still orders its pause


async def first(stream, wanted=lambda value: True):
    async for value in stream:
        if wanted(value):
            return value
    raise EOFError


async def armed(action):
    """Arm; on a busy computer a task may be late for a moment, and then arming is denied."""
    while True:
        try:
            return await action.arm()
        except ActionError:
            await asyncio.sleep(0.5)


def corner(number, lat, lon):
    place = {"x": round(lat * 1e7), "y": round(lon * 1e7), "z": 0.0}
    return RawItem(number, 0, 5001, 0, 1, 4.0, 0.0, 0.0, 0.0, **place, mission_type=1)


def waypoint(home, north, east, altitude, speed):
    place = home.latitude_deg + north * NORTH, home.longitude_deg + east * EAST, altitude
    return MissionItem(*place, speed, True, NAN, NAN, 0, NAN, NAN, NAN, NAN, NAN, 0)


class Steps:
    """The steps, with their results."""

    def __init__(self, system, kind):
        self.kind, self.results = kind, {}
        self.telemetry, self.action, self.camera = TelemetryAsync(system), ActionAsync(system), CameraAsync(system)
        self.mission, self.raw = MissionAsync(system), MissionRawAsync(system)
        self.altitude = {"submarine": -2.0, "boat": 0.0}.get(kind, 12.0)

    async def take(self, name, step):
        """Take a step; its result is what it returns, or why it fails."""
        try:
            self.results[name] = await asyncio.wait_for(step, PATIENCE)
        except Exception as error:
            self.results[name] = f"{type(error).__name__}: {error}"

    async def telemetry_of(self, name):
        value = await first(getattr(self.telemetry, f"subscribe_{name}")())
        return json.loads(json.dumps(vars(value), default=vars))

    async def fence(self):
        """A fence of four corners, and how it comes back."""
        home = self.home
        places = [(north * NORTH, east * EAST) for north, east in ((-300, -300), (300, -300), (300, 300), (-300, 300))]
        sent = [
            corner(number, home.latitude_deg + lat, home.longitude_deg + lon)
            for number, (lat, lon) in enumerate(places)
        ]
        await self.raw.upload_geofence(sent)
        got = await self.raw.download_geofence()
        return [(item.command, item.x, item.y) for item in sent] == [(item.command, item.x, item.y) for item in got]

    async def take_off(self):
        """Climb to an altitude that MAVSDK sets; it, and that at which the vehicle is when it holds."""
        await self.action.set_takeoff_altitude(8.0)
        await self.action.takeoff()
        await first(self.telemetry.subscribe_position(), lambda place: place.relative_altitude_m > 5.0)
        await first(self.telemetry.subscribe_flight_mode(), lambda mode: mode.name == "HOLD")
        place = await first(self.telemetry.subscribe_position())
        return await self.action.get_takeoff_altitude(), place.relative_altitude_m

    async def upload(self):
        place = self.home, 40, 0, self.altitude, SLOW
        last = self.home, 40, 30, self.altitude, SLOW
        await self.mission.upload_mission(MissionPlan(mission_items=[waypoint(*place), waypoint(*last)]))
        return "done"

    async def in_mode(self, order, name):
        """Give an order whose mode may be over when its acknowledgment comes; the mode, once it was seen."""
        seen = asyncio.create_task(first(self.telemetry.subscribe_flight_mode(), lambda mode: mode.name == name))
        try:
            await order
            return (await seen).name
        finally:
            seen.cancel()

    async def fly(self):
        await first(self.mission.subscribe_mission_progress(), lambda progress: progress.current == progress.total)
        return await self.mission.is_mission_finished()

    async def land_and_disarm(self):
        """The end: a multirotor lands, the others hold; then none is armed."""
        if self.kind == "hexacopter":
            await self.action.land()
            await first(self.telemetry.subscribe_landed_state(), lambda state: state.name == "ON_GROUND")
        else:
            await self.action.hold()
            await self.action.disarm()
        await first(self.telemetry.subscribe_armed(), lambda value: not value)
        return "done"

    async def photo(self):
        cameras = await first(self.camera.subscribe_camera_list(), lambda found: found.cameras)
        shots = asyncio.ensure_future(anext(self.camera.subscribe_capture_info()))
        await asyncio.sleep(0.1)
        await self.camera.take_photo(cameras.cameras[0].component_id)
        return (await shots).is_success

    async def all(self):
        self.home = await first(self.telemetry.subscribe_home())
        sensors = ["attitude_quaternion", "scaled_pressure", "imu", "odometry"]
        for name in sensors if self.kind == "hexacopter" else [*sensors, "distance_sensor"]:
            await self.take(name, self.telemetry_of(name))
        await self.take("fence", self.fence())
        if self.kind == "submarine":
            await self.take("photo", self.photo())
        await self.take("arm", armed(self.action))
        if self.kind == "hexacopter":
            await self.take("takeoff", self.take_off())
        await self.take("upload", self.upload())
        await self.take("start", self.in_mode(self.mission.start_mission(), "MISSION"))
        await self.take("pause", self.in_mode(self.mission.pause_mission(), "HOLD"))
        await self.take("resume", self.in_mode(self.mission.start_mission(), "MISSION"))
        await self.take("finished", self.fly())
        await self.take("disarmed", self.land_and_disarm())
        return self.results


async def main():
    configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    async with Mavsdk(configuration) as sdk:
        await sdk.add_any_connection(f"udpin://127.0.0.1:{sys.argv[1]}")
        print(json.dumps(await Steps(await sdk.first_autopilot(15.0), sys.argv[2]).all()), flush=True)


asyncio.run(main())

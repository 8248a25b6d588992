"""A MAVSDK program that flies a mission and gives orders: port and kind of vehicle are its arguments, JSON its output.

The mission goes 60 m north, 40 m east; it is paused on its first leg, and continued when the vehicle has held for 80 s
of its own time. What it hears as texts is part of the output.
"""

import asyncio
import math
import sys

from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.mission import MissionAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.action import ActionError
from mavsdk.plugins.mission import MissionError, MissionItem, MissionPlan
from mavsdk_program import first, run

NORTH, EAST = 1 / 111_100.0, 1 / 83_800.0  # degrees per m at 41.2 degrees
NAN = math.nan
HOLD = 80.0  # s


async def until(stream, seconds):
    """What a stream has until its time has moved on by so much."""
    began = None
    async for value in stream:
        began = value.timestamp_us if began is None else began
        yield value
        if value.timestamp_us - began >= seconds * 1e6:
            return


async def ready(action):
    """Arm; on a busy computer a task may be late for a moment, and then arming is denied."""
    for _ in range(20):
        try:
            await action.arm()
            return
        except ActionError:
            await asyncio.sleep(0.5)


async def upload(mission, items):
    """Upload, again if the line was too bad; MAVSDK is busy for a moment after an upload that was refused."""
    while True:
        try:
            await mission.upload_mission(MissionPlan(mission_items=items))
            return
        except MissionError as error:
            if "BUSY" not in str(error) and "TIMEOUT" not in str(error):
                raise
            await asyncio.sleep(0.1)


def item(home, north, east, altitude, speed):
    return MissionItem(
        latitude_deg=home.latitude_deg + north * NORTH,
        longitude_deg=home.longitude_deg + east * EAST,
        relative_altitude_m=altitude,
        speed_m_s=speed,
        is_fly_through=True,
        gimbal_pitch_deg=NAN,
        gimbal_yaw_deg=NAN,
        camera_action=0,
        loiter_time_s=NAN,
        camera_photo_interval_s=NAN,
        acceptance_radius_m=NAN,
        yaw_deg=NAN,
        camera_photo_distance_m=NAN,
        vehicle_action=0,
    )


async def fly(system, kind):
    telemetry, mission, action = TelemetryAsync(system), MissionAsync(system), ActionAsync(system)
    altitude = {"submarine": -3.0, "boat": 0.0}.get(kind, 12.0)
    speed = {"submarine": 1.2, "boat": 1.2}.get(kind, 5.0)
    seen = {}

    async def mode(name):
        return (await first(telemetry.subscribe_flight_mode(), lambda mode: mode.name == name)).name

    async def mode_after(name, order):
        """Give an order whose mode may be over when the acknowledgement comes, and wait until this mode was seen."""
        seen_mode = asyncio.create_task(mode(name))
        await order
        return await seen_mode

    async def near(north, east, meters):
        def close(p):
            return (
                math.hypot(
                    (p.latitude_deg - home.latitude_deg) / NORTH - north,
                    (p.longitude_deg - home.longitude_deg) / EAST - east,
                )
                < meters
            )

        return (await first(telemetry.subscribe_position(), close)).relative_altitude_m

    async def passed(seconds):
        """Wait until so much of the vehicle's time has passed."""
        times = [attitude.timestamp_us async for attitude in until(telemetry.subscribe_attitude_euler(), seconds)]
        return (times[-1] - times[0]) / 1e6

    texts = []

    async def listen():
        async for text in telemetry.subscribe_status_text():
            texts.append(text.text)

    listener = asyncio.create_task(listen())
    home = await first(telemetry.subscribe_home())
    seen["place"] = [home.latitude_deg, home.longitude_deg]
    await first(telemetry.subscribe_health_all_ok(), bool)
    parameters = await ParamAsync(system).get_all_params()
    seen["parameters"] = len(parameters.int_params) + len(parameters.float_params)
    absurd = item(home, 60, 0, math.copysign(9999.0, altitude or -1.0), speed)
    while not any(text.startswith("Mission rejected: item 0") for text in texts):  # a text may be lost
        try:
            await upload(mission, [absurd])
        except MissionError as error:
            seen["refused"] = str(error)
    items = [item(home, 60, 0, altitude, speed), item(home, 60, 40, altitude, speed)]
    await upload(mission, items)
    back = await mission.download_mission()
    seen["downloaded"] = [
        [i.latitude_deg - home.latitude_deg, i.relative_altitude_m, i.speed_m_s] for i in back.mission_items
    ]
    await ready(action)
    await mission.start_mission()
    seen["mission"] = await mode("MISSION")
    await near(40, 0, 15)
    await mission.pause_mission()
    seen["paused"] = await mode("HOLD")
    seen["held_for"] = await passed(HOLD)
    seen["continued"] = await mode_after("MISSION", mission.start_mission())
    seen["reached"] = await near(60, 0, 12)
    await first(mission.subscribe_mission_progress(), lambda progress: progress.current == progress.total)
    seen["finished"] = await mission.is_mission_finished()
    await action.goto_location(
        home.latitude_deg + 20 * NORTH, home.longitude_deg + 20 * EAST, home.absolute_altitude_m + altitude, NAN
    )
    seen["there"] = await near(20, 20, 12)
    await action.hold()
    seen["held"] = await mode("HOLD")
    seen["returning"] = await mode_after("RETURN_TO_LAUNCH", action.return_to_launch())
    seen["home"] = await near(0, 0, 16)
    if kind == "hexacopter":
        await first(telemetry.subscribe_landed_state(), lambda state: state.name == "ON_GROUND")
        seen["taken_off"] = await mode_after("TAKEOFF", action.takeoff())
        await first(telemetry.subscribe_position(), lambda p: p.relative_altitude_m > 8.0)
        seen["landing"] = await mode_after("LAND", action.land())
    await mission.clear_mission()
    seen["cleared"] = len((await mission.download_mission()).mission_items)
    listener.cancel()
    return {**seen, "texts": texts}


run(lambda system: fly(system, sys.argv[2]))

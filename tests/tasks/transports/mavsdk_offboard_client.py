"""A MAVSDK program that sends an AUV 40 m north at 3 m depth by position targets; JSON is its output."""

import asyncio
import json
import sys

from mavsdk.asyncio.mavsdk import Mavsdk
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.component_type import ComponentType
from mavsdk.mavsdk import Configuration
from mavsdk.plugins.offboard import PositionNedYaw


async def first(stream, wanted=lambda value: True):
    async for value in stream:
        if wanted(value):
            return value
    return None


async def fly(system):
    telemetry, offboard = TelemetryAsync(system), OffboardAsync(system)
    await first(telemetry.subscribe_health_all_ok(), bool)
    await offboard.set_position_ned(PositionNedYaw(40.0, 0.0, 3.0, 0.0))
    await offboard.start()
    seen = {"mode": (await first(telemetry.subscribe_flight_mode(), lambda mode: mode.name == "OFFBOARD")).name}
    there = await first(telemetry.subscribe_position_velocity_ned(), lambda p: p.position.north_m > 30.0)
    seen["depth"] = there.position.down_m
    await offboard.stop()
    seen["after"] = (await first(telemetry.subscribe_flight_mode(), lambda mode: mode.name == "HOLD")).name
    return seen


async def main():
    configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    async with Mavsdk(configuration) as sdk:
        await sdk.add_any_connection(f"udpin://127.0.0.1:{sys.argv[1]}")
        system = await sdk.first_autopilot(15.0)
        print(json.dumps(await fly(system)), flush=True)


asyncio.run(main())

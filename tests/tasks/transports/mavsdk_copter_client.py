"""A MAVSDK program that watches a flight: prints "ready", then the changes until landing, as JSON."""

import asyncio
import json
import sys

from mavsdk.asyncio.mavsdk import Mavsdk
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.component_type import ComponentType
from mavsdk.mavsdk import Configuration


async def note(stream, found, word):
    async for value in stream:
        if found[-1:] != [word(value)]:
            found.append(word(value))


async def watch(system):
    telemetry = TelemetryAsync(system)
    seen = {"modes": [], "landed": [], "in_air": [], "armed": [], "positions": []}
    async for position in telemetry.subscribe_position():
        seen["start"] = vars(position)
        break
    streams = (
        (telemetry.subscribe_flight_mode(), "modes", lambda mode: mode.name),
        (telemetry.subscribe_landed_state(), "landed", lambda state: state.name),
        (telemetry.subscribe_in_air(), "in_air", bool),
        (telemetry.subscribe_armed(), "armed", bool),
        (telemetry.subscribe_position(), "positions", lambda p: (p.relative_altitude_m, p.absolute_altitude_m)),
    )
    tasks = [asyncio.create_task(note(stream, seen[name], word)) for stream, name, word in streams]
    while not all(seen.values()):
        await asyncio.sleep(0.02)
    print("ready", flush=True)
    while not ("IN_AIR" in seen["landed"] and seen["landed"][-1] == "ON_GROUND" and not seen["armed"][-1]):
        await asyncio.sleep(0.02)
    for task in tasks:
        task.cancel()
    return seen


async def main():
    configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    async with Mavsdk(configuration) as sdk:
        await sdk.add_any_connection(f"udpin://127.0.0.1:{sys.argv[1]}")
        system = await sdk.first_autopilot(15.0)
        print(json.dumps(await watch(system), default=str), flush=True)


asyncio.run(main())

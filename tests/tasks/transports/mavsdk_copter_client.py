"""A MAVSDK program that watches a flight: prints "ready", then the changes until landing, as JSON."""

import asyncio

from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk_program import run


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


run(watch)

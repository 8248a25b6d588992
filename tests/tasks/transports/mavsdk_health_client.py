"""Connects to the port in its argument, and ends when MAVSDK finds everything well."""

import asyncio
import sys

from mavsdk.asyncio.mavsdk import Mavsdk
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.component_type import ComponentType
from mavsdk.mavsdk import Configuration


async def main():
    configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    async with Mavsdk(configuration) as sdk:
        await sdk.add_any_connection(f"udpin://127.0.0.1:{sys.argv[1]}")
        telemetry = TelemetryAsync(await sdk.first_autopilot(15.0))
        async for well in telemetry.subscribe_health_all_ok():
            if well:
                print("well", flush=True)
                return


asyncio.run(main())

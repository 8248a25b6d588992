"""What MAVSDK programs share: the port of the vehicle is the first argument, JSON the output."""

import asyncio
import json
import sys

from mavsdk.asyncio.mavsdk import Mavsdk
from mavsdk.component_type import ComponentType
from mavsdk.mavsdk import Configuration


async def first(stream, wanted=lambda value: True):
    """The first value of a stream that is wanted; None if the stream ends before."""
    async for value in stream:
        if wanted(value):
            return value
    return None


def run(act, default=str):
    """Connect, and print what `act` returns of the vehicle."""

    async def main():
        configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
        async with Mavsdk(configuration) as sdk:
            await sdk.add_any_connection(f"udpin://127.0.0.1:{sys.argv[1]}")
            print(json.dumps(await act(await sdk.first_autopilot(15.0)), default=default), flush=True)

    asyncio.run(main())

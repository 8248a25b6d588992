"""A MAVSDK program that sends an AUV 40 m north at 3 m depth by position targets; JSON is its output."""

from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.offboard import PositionNedYaw
from mavsdk_program import first, run


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


run(fly)

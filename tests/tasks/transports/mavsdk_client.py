"""A typical MAVSDK program: connects to the port in its argument and prints what it received as JSON."""

from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.info import InfoAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.action import ActionError
from mavsdk.plugins.param import ParamError
from mavsdk_program import first, run


async def look(system):
    telemetry, parameters = TelemetryAsync(system), ParamAsync(system)
    action, info = ActionAsync(system), InfoAsync(system)
    seen = {}
    for name in ("position", "home", "attitude_euler", "attitude_angular_velocity_body", "velocity_ned"):
        seen[name] = vars(await first(getattr(telemetry, f"subscribe_{name}")()))
    local = await first(telemetry.subscribe_position_velocity_ned())
    seen["local"] = vars(local.position)
    seen["armable"] = (await first(telemetry.subscribe_health(), lambda health: health.is_armable)).is_armable
    seen["version"] = (await info.get_version()).flight_sw_major

    everything = await parameters.get_all_params()
    seen["parameters"] = {p.name: p.value for p in [*everything.int_params, *everything.float_params]}
    seen["before"] = [
        await parameters.get_param_float("SURVEYOR_GAIN"),
        await parameters.get_param_int("SURVEYOR_BEAMS"),
    ]
    await parameters.set_param_float("SURVEYOR_GAIN", 2.25)
    await parameters.set_param_int("SURVEYOR_BEAMS", -123456789)
    seen["after"] = [
        await parameters.get_param_float("SURVEYOR_GAIN"),
        await parameters.get_param_int("SURVEYOR_BEAMS"),
    ]
    seen["errors"] = []
    for name, value in (("SURVEYOR_GAIN", 99.0), ("NOTHING", 1.0)):
        try:
            await parameters.set_param_float(name, value)
        except ParamError as error:
            seen["errors"].append(str(error))

    await action.arm()
    seen["armed"] = await first(telemetry.subscribe_armed(), lambda armed: armed)
    await action.hold()
    seen["mode"] = (await first(telemetry.subscribe_flight_mode(), lambda mode: mode.name == "HOLD")).name
    try:
        await action.return_to_launch()
    except ActionError as error:
        seen["refused"] = str(error)
    await action.disarm()
    return seen


run(look)

"""A MAVSDK program that uses the cameras: the port is its argument; it prints what it saw."""

import asyncio
import contextlib

from mavsdk.asyncio.plugins.camera import CameraAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.plugins.param import ParamError, ProtocolVersion
from mavsdk_program import run

FISHEYE, MUG = 100, 101


async def use(system):
    camera, settings, seen = CameraAsync(system), ParamAsync(system), {}
    async for found in camera.subscribe_camera_list():
        if len(found.cameras) == 2:
            seen["cameras"] = [
                [c.component_id, c.vendor_name, c.model_name, c.horizontal_resolution_px, c.vertical_resolution_px]
                for c in found.cameras
            ]
            break
    captures = camera.subscribe_capture_info()
    first = asyncio.ensure_future(anext(captures))
    await asyncio.sleep(0.1)
    await camera.take_photo(FISHEYE)
    shot = await first
    place = shot.position
    seen["shot"] = [shot.component_id, shot.is_success, shot.index, shot.file_url]
    seen["place"] = [place.latitude_deg, place.longitude_deg, place.relative_altitude_m]
    with contextlib.suppress(ParamError):  # it selects, and then reports no result
        await settings.select_component(FISHEYE, ProtocolVersion.EXT)
    names = await settings.get_all_params()
    seen["settings"] = [len(names.int_params), len(names.float_params), len(names.custom_params)]
    await settings.set_param_custom("SCENE", "Sea Surface")
    seen["scene"] = await settings.get_param_custom("SCENE")
    await settings.set_param_float("FRAME_RATE", 2.5)
    seen["rate"] = await settings.get_param_float("FRAME_RATE")
    return seen


run(use, bytes.decode)

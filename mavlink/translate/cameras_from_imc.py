"""Cameras as MAVLink fields: themselves, their pictures and detections."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from mavlink.dialect import Fields
from mavlink.positions import GlobalPosition
from support.rotations import quaternion_from_euler

COMPONENTS = range(100, 106)  # MAV_COMP_ID_CAMERA to CAMERA6
CAMERA, NO_AUTOPILOT, ACTIVE = 30, 8, 4  # MAV_TYPE, MAV_AUTOPILOT, MAV_STATE
CAPTURES, STREAMS, DETECTS = 2, 256, 2048  # CAMERA_CAP_FLAGS
IDLE, ONE, SERIES = 0, 1, 2  # image_status of CAMERA_CAPTURE_STATUS
READY = 2  # STORAGE_STATUS
RUNNING = 1  # VIDEO_STREAM_STATUS_FLAGS; the type 0 is RTSP
POINT_OBSTACLE, COORDINATES, ALTITUDE, CALLSIGN = 19, 1, 2, 16  # ADSB_EMITTER_TYPE, ADSB_FLAGS
MEBIBYTE = 1 << 20
VENDOR = "Shoal"
DEGREES = 1e7


class Detection(NamedTuple):
    """A detected object: rad, m above mean sea level, m from the vehicle (NaN: unknown), s since 1970."""

    number: int
    lat: float
    lon: float
    altitude: float
    distance: float
    time: float


class Picture(NamedTuple):
    """A picture in a file: where its camera was, roll, pitch and yaw in rad, s since 1970."""

    file: str
    time: float
    place: GlobalPosition
    angles: tuple[float, float, float]


def heartbeat(status: int) -> Fields:
    return {"type": CAMERA, "autopilot": NO_AUTOPILOT, "system_status": status, "mavlink_version": 3}


def information(name: str, resolution: tuple[int, int], flags: int, definition: tuple[str, int], time: int) -> Fields:
    """CAMERA_INFORMATION; the resolution is in px. `definition` is the address and version of the settings' file."""
    return {
        "time_boot_ms": time,
        "vendor_name": _letters(VENDOR),
        "model_name": _letters(name),
        "focal_length": math.nan,
        "sensor_size_h": math.nan,
        "sensor_size_v": math.nan,
        "resolution_h": resolution[0],
        "resolution_v": resolution[1],
        "flags": flags,
        "cam_definition_uri": definition[0].encode(),
        "cam_definition_version": definition[1],
    }


def settings(time: int) -> Fields:
    """CAMERA_SETTINGS: takes pictures, without zoom and focus."""
    return {"time_boot_ms": time, "zoomLevel": math.nan, "focusLevel": math.nan}


def storage(total: float, used: float, free: float, time: int) -> Fields:
    """STORAGE_INFORMATION of one disk, in bytes."""
    return {
        "time_boot_ms": time,
        "storage_id": 1,
        "storage_count": 1,
        "status": READY,
        "total_capacity": total / MEBIBYTE,
        "used_capacity": used / MEBIBYTE,
        "available_capacity": free / MEBIBYTE,
    }


def capture_status(status: int, interval: float, taken: int, free: float, time: int) -> Fields:
    return {
        "time_boot_ms": time,
        "image_status": status,
        "image_interval": interval,
        "available_capacity": free / MEBIBYTE,
        "image_count": taken,
    }


def image_captured(picture: Picture, index: int, url: str, time: int) -> Fields:
    place = picture.place
    return {
        "time_boot_ms": time,
        "time_utc": round(picture.time * 1e6),
        "lat": math.degrees(place.lat) * DEGREES,
        "lon": math.degrees(place.lon) * DEGREES,
        "alt": place.altitude * 1e3,
        "relative_alt": place.relative * 1e3,
        "q": quaternion_from_euler(*picture.angles),
        "image_index": index,
        "capture_result": 1,
        "file_url": url.encode(),
    }


def video(name: str, uri: str, rate: float, resolution: tuple[int, int], field_of_view: float) -> Fields:
    """VIDEO_STREAM_INFORMATION and VIDEO_STREAM_STATUS of an RTSP stream; the field of view is in °."""
    return {
        "stream_id": 1,
        "count": 1,
        "flags": RUNNING,
        "framerate": rate,
        "resolution_h": resolution[0],
        "resolution_v": resolution[1],
        "hfov": field_of_view,
        "name": name.encode()[:31],
        "uri": uri.encode(),
    }


def tracking_geo_status(found: Detection) -> Fields:
    """CAMERA_TRACKING_GEO_STATUS."""
    unknown = ("h_acc", "v_acc", "vel_n", "vel_e", "vel_d", "vel_acc", "hdg", "hdg_acc")
    return {
        **dict.fromkeys(unknown, math.nan),
        "tracking_status": 1,
        "lat": math.degrees(found.lat) * DEGREES,
        "lon": math.degrees(found.lon) * DEGREES,
        "alt": found.altitude,
        "dist": found.distance,
    }


def adsb_marker(found: Detection, name: str, system: int, now: float) -> Fields:
    """ADSB_VEHICLE: maps show the object, since they support no other message for one."""
    deep = math.isfinite(found.altitude)
    return {
        "ICAO_address": (system << 16) + (found.number & 0xFFFF),
        "lat": math.degrees(found.lat) * DEGREES,
        "lon": math.degrees(found.lon) * DEGREES,
        "altitude": found.altitude * 1e3 if deep else 0,
        "altitude_type": 1,
        "callsign": name.encode()[:8],
        "emitter_type": POINT_OBSTACLE,
        "tslc": max(0.0, now - found.time),
        "flags": COORDINATES | CALLSIGN | (ALTITUDE if deep else 0),
    }


def _letters(text: str) -> Sequence[int]:
    return list(text.encode()[:31])

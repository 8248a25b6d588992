"""Positions that Shoal measures better than an autopilot, such as under water, as its GPS."""

import math

import imc
from mavlink import Fields
from mavlink.autopilot.telemetry import is_valid_message
from mavlink.positions import degrees_e7

Validity = imc.GpsFix.Validity
NO_FIX, FIX_3D = 1, 3  # GPS_FIX_TYPE
# GPS_INPUT_IGNORE_FLAGS
NO_HEIGHT = 1
NO_VDOP, NO_LEVEL_SPEED, NO_VERTICAL_SPEED, NO_SPEED_ACCURACY = 4, 8, 16, 32
NO_HEIGHT_ACCURACY = 128
SATELLITES = 10  # reported for a fix that has none, since an autopilot needs at least 6
HDOP = 1.0
USUAL_ACCURACY = 5.0  # m
GPS_EPOCH = 315964800  # 1980-01-06 UTC, in s since 1970
LEAP_SECONDS = 18  # GPS time - UTC since 2017
WEEK = 604800  # s


def is_usable_fix(fix: imc.GpsFix) -> bool:
    """Whether a fix has no number that is none, besides an unknown height, and is on Earth."""
    known = fix.replace(height=0.0) if math.isnan(fix.height) else fix
    return is_valid_message(known) and fix.sog >= 0.0


def gps_input_fields(fix: imc.GpsFix, undulation: float, now: float) -> Fields:
    """GPS_INPUT with a fix; `undulation` (m) is that of the geoid. Speeds are those of the fix, never vertical."""
    valid = fix.validity
    ignored = NO_VERTICAL_SPEED | NO_SPEED_ACCURACY
    moves = valid & Validity.VALID_SOG and valid & Validity.VALID_COG
    for flag, known in (
        (NO_LEVEL_SPEED, moves),
        (NO_HEIGHT, math.isfinite(fix.height)),
        (NO_VDOP, valid & Validity.VALID_VDOP),
        (NO_HEIGHT_ACCURACY, valid & Validity.VALID_VACC),
    ):
        ignored |= 0 if known else flag
    week, seconds = divmod(now - GPS_EPOCH + LEAP_SECONDS, WEEK)
    return {
        "time_usec": round(now * 1e6),
        "time_week": int(week),
        "time_week_ms": round(seconds * 1e3),
        "gps_id": 0,
        "ignore_flags": ignored,
        "fix_type": FIX_3D if valid & Validity.VALID_POS else NO_FIX,
        "lat": degrees_e7(fix.lat),
        "lon": degrees_e7(fix.lon),
        "alt": fix.height - undulation if math.isfinite(fix.height) else 0.0,
        "hdop": fix.hdop if valid & Validity.VALID_HDOP else HDOP,
        "vdop": fix.vdop,
        "vn": fix.sog * math.cos(fix.cog) if moves else 0.0,
        "ve": fix.sog * math.sin(fix.cog) if moves else 0.0,
        "horiz_accuracy": fix.hacc if valid & Validity.VALID_HACC else USUAL_ACCURACY,
        "vert_accuracy": fix.vacc,
        "satellites_visible": fix.satellites or SATELLITES,
    }


def usbl_fix(usbl: imc.UsblFixExtended, undulation: float) -> imc.GpsFix:
    """Convert a measurement of a USBL to a fix; its depth is below the sea, where heights are those of the geoid."""
    return imc.GpsFix(
        validity=Validity.VALID_POS | (Validity.VALID_HACC if usbl.accuracy > 0.0 else 0),
        lat=usbl.lat,
        lon=usbl.lon,
        height=undulation - usbl.z if usbl.z_units == imc.ZUnits.DEPTH else undulation,
        hacc=usbl.accuracy,
    )

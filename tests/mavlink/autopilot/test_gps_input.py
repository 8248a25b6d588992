"""Positions of other sensors as the GPS of an autopilot."""

import math

import pytest

import imc
from mavlink.autopilot.gps_input import GPS_EPOCH, gps_input_fields, is_usable_fix, usbl_fix
from mavlink.translate.sensors_from_imc import gps_raw


def fix(**values):
    good = imc.GpsFix.Validity.VALID_POS | imc.GpsFix.Validity.VALID_HDOP
    return imc.GpsFix(**{"validity": good, "lat": 0.7, "lon": -0.15, "height": 52.6, "hdop": 1.5, **values})


def test_a_fix_of_unknown_height_is_a_position_without_a_height():
    level = fix(height=math.nan)
    assert is_usable_fix(level)
    said = gps_input_fields(level, 54.6, GPS_EPOCH + 604800.0)
    assert (said["alt"], said["fix_type"], said["ignore_flags"] & 1) == (0.0, 3, 1)
    raw = gps_raw(level, level, 54.6)
    assert (raw["fix_type"], raw["alt"], raw["lat"]) == (2, 0, said["lat"])
    assert gps_raw(fix(lat=math.nan), None, 54.6)["fix_type"] == 1


def test_a_position_of_shoal_becomes_the_gps_of_the_autopilot():
    said = gps_input_fields(fix(), 54.6, GPS_EPOCH + 604800.0 + 100.0)
    assert (said["lat"], said["lon"]) == (round(math.degrees(0.7) * 1e7), round(math.degrees(-0.15) * 1e7))
    assert said["alt"] == pytest.approx(-2.0)
    assert (said["fix_type"], said["hdop"], said["ignore_flags"]) == (3, 1.5, 4 | 8 | 16 | 32 | 128)
    assert (said["time_week"], said["time_week_ms"]) == (1, 118_000)
    flags = imc.GpsFix.Validity
    moving = gps_input_fields(
        fix(validity=flags.VALID_POS | flags.VALID_SOG | flags.VALID_COG, sog=2.0, cog=math.pi), 0.0, 2e9
    )
    assert (moving["vn"], moving["ve"]) == pytest.approx((-2.0, 0.0), abs=1e-9)
    assert moving["ignore_flags"] & 8 == 0
    assert gps_input_fields(fix(validity=0), 0.0, 2e9)["fix_type"] == 1
    under = usbl_fix(imc.UsblFixExtended(lat=0.7, lon=-0.15, z=12.0, z_units=imc.ZUnits.DEPTH, accuracy=2.0), 54.6)
    assert (under.height, under.hacc) == pytest.approx((42.6, 2.0))

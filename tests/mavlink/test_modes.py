"""Names of the modes of other autopilots."""

from types import SimpleNamespace

import pytest
from pymavlink import mavutil

from mavlink import load_dialect
from mavlink.modes import mode_name

ENUMERATIONS = load_dialect().enumerations
NEWER = {"MOTORDETECT", "SURFTRAK", "SERVO_TEST"}  # in the dialect, unknown to mavutil


@pytest.mark.parametrize("kind", range(40))
def test_names_are_those_of_ground_stations(kind):
    for base in (0, 1, 81, 209):
        for custom in (*range(60), 0xFFFFFFFF):
            beat = SimpleNamespace(
                autopilot=3, base_mode=base, custom_mode=custom, type=kind, get_type=lambda: "HEARTBEAT"
            )
            name = mode_name(base, custom, kind, 3, ENUMERATIONS)
            assert name == mavutil.mode_string_v10(beat) or name in NEWER


def test_names_of_px4():
    for main in range(12):
        for sub in range(12):
            custom = main << 16 | sub << 24
            assert mode_name(209, custom, 2, 12, ENUMERATIONS) == mavutil.interpret_px4_mode(209, custom)

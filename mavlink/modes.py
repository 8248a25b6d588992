"""The modes of a vehicle, and their numbers in each flavor of autopilot."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import imc

OpMode = imc.VehicleState.OpMode
PlanState = imc.PlanControlState.State

CUSTOM_MODE, AUTO, GUIDANCE, STABILIZE, MANUAL_INPUT, ARMED = 1, 4, 8, 16, 64, 128
MISSION_INT, COMMAND_INT, PARAM_BYTEWISE, FTP, MAVLINK2, FENCE, PARAM_C_CAST = 4, 8, 16, 32, 8192, 16384, 131072
ATTITUDE_TARGETS, POSITION_TARGETS = 64, 128 | 256
BOOT, CALIBRATING, STANDBY, ACTIVE, CRITICAL, EMERGENCY = 1, 2, 3, 4, 5, 6


NOT_SELECTABLE, AUTOMATIC = 2, 4  # MAV_MODE_PROPERTY


class Mode(Enum):
    """Mode of a vehicle; `flags` are its MAV_MODE_FLAG bits, without those of custom mode and arming."""

    MANUAL = "manual", 0
    MISSION = "mission", AUTO | GUIDANCE | STABILIZE
    HOLD = "hold", GUIDANCE | STABILIZE
    GUIDED = "guided", GUIDANCE | STABILIZE
    OFFBOARD = "offboard", GUIDANCE | STABILIZE
    TELEOPERATION = "teleoperation", MANUAL_INPUT | STABILIZE
    RETURN = "return", AUTO | STABILIZE
    TAKEOFF = "takeoff", AUTO | GUIDANCE | STABILIZE
    LAND = "land", AUTO | GUIDANCE | STABILIZE
    OTHER = "other", STABILIZE

    @property
    def flags(self) -> int:
        return self.value[1]

    @property
    def standard(self) -> int:
        """MAV_STANDARD_MODE."""
        return next((number for number, mode in STANDARD_MODES.items() if mode is self), 0)


@dataclass(frozen=True, slots=True)
class VehicleKind:
    """A kind of vehicle: its MAV_TYPE, ArduPilot's name of its firmware, the numbers of its modes there.

    The first number of a mode is the one reported. `afloat`: home is at the water's surface.
    """

    type: int
    firmware: str
    modes: Mapping[Mode, tuple[int, ...]]
    afloat: bool = False

    def mode_properties(self, mode: Mode) -> int:
        """MAV_MODE_PROPERTY; no station can put an aircraft under manual control."""
        refused = NOT_SELECTABLE if mode is Mode.TELEOPERATION and not self.afloat else 0
        return refused | (AUTOMATIC if mode.flags & AUTO else 0)


COPTER: Mapping[Mode, tuple[int, ...]] = {
    Mode.MANUAL: (0,),
    Mode.TELEOPERATION: (1,),
    Mode.MISSION: (3,),
    Mode.HOLD: (5, 16, 17, 2),
    Mode.GUIDED: (4,),
    Mode.OFFBOARD: (4,),
    Mode.RETURN: (6,),
    Mode.TAKEOFF: (4,),
    Mode.LAND: (9,),
}

KINDS: Mapping[str, VehicleKind] = {
    "submarine": VehicleKind(
        12,
        "ArduSub",
        {
            Mode.MANUAL: (19,),
            Mode.TELEOPERATION: (0,),
            Mode.MISSION: (3,),
            Mode.HOLD: (16, 2),
            Mode.GUIDED: (4,),
            Mode.OFFBOARD: (4,),
            Mode.RETURN: (9,),
        },
        afloat=True,
    ),
    "boat": VehicleKind(
        11,
        "ArduRover",
        {
            Mode.MANUAL: (0,),
            Mode.TELEOPERATION: (3,),
            Mode.MISSION: (10,),
            Mode.HOLD: (5, 4),
            Mode.GUIDED: (15,),
            Mode.OFFBOARD: (15,),
            Mode.RETURN: (11, 12),
        },
        afloat=True,
    ),
    "plane": VehicleKind(
        1,
        "ArduPlane",
        {
            Mode.MANUAL: (0,),
            Mode.TELEOPERATION: (2,),
            Mode.MISSION: (10,),
            Mode.HOLD: (12,),
            Mode.GUIDED: (15,),
            Mode.OFFBOARD: (15,),
            Mode.RETURN: (11,),
        },
    ),
    "copter": VehicleKind(2, "ArduCopter", COPTER),
    "hexacopter": VehicleKind(13, "ArduCopter", COPTER),
}

# PX4: main mode << 16 | sub mode << 24
PX4_MODES: Mapping[Mode, tuple[int, ...]] = {
    Mode.MANUAL: (1 << 16,),
    Mode.TELEOPERATION: (3 << 16,),
    Mode.MISSION: (4 << 16 | 4 << 24,),
    Mode.HOLD: (4 << 16 | 3 << 24,),
    Mode.GUIDED: (4 << 16 | 3 << 24,),  # PX4 goes to a place in its hold
    Mode.OFFBOARD: (6 << 16,),
    Mode.RETURN: (4 << 16 | 5 << 24,),
    Mode.TAKEOFF: (4 << 16 | 2 << 24,),
    Mode.LAND: (4 << 16 | 6 << 24,),
}

ARDUPILOT, AUTOPILOT_NONE, PX4 = 3, 8, 12  # MAV_AUTOPILOT
GROUND_STATION = 6  # MAV_TYPE
PX4_NAMES: Mapping[tuple[int, int], str] = {
    (1, 0): "MANUAL",
    (2, 0): "ALTCTL",
    (3, 0): "POSCTL",
    (4, 2): "TAKEOFF",
    (4, 3): "LOITER",
    (4, 4): "MISSION",
    (4, 5): "RTL",
    (4, 6): "LAND",
    (4, 7): "RTGS",
    (4, 8): "FOLLOWME",
    (5, 0): "ACRO",
    (6, 0): "OFFBOARD",
    (7, 0): "STABILIZED",
    (8, 0): "RATTITUDE",
}
"""Main and sub mode of PX4 -> their name in ground stations."""

BLIMP_MODES = ("LAND", "MANUAL", "VELOCITY", "LOITER", "RTL", "AUTO", "HOLD")

ARDUPILOT_MODES: Mapping[int, str] = {
    **dict.fromkeys((1, 19, 20, 21), "PLANE_MODE"),
    **dict.fromkeys((2, 3, 4, 13, 14, 15, 29, 35), "COPTER_MODE"),
    **dict.fromkeys((10, 11), "ROVER_MODE"),
    5: "TRACKER_MODE",
    7: "BLIMP_MODE",
    12: "SUB_MODE",
}
"""MAV_TYPE -> the enumeration of ArduPilot's modes."""

GROUND_STATION_NAMES: Mapping[tuple[str, int], str] = {
    ("PLANE_MODE", 5): "FBWA",
    ("PLANE_MODE", 6): "FBWB",
    ("PLANE_MODE", 16): "INITIALISING",
    ("PLANE_MODE", 25): "LOITERALTQLAND",
    ("COPTER_MODE", 8): "POSITION",
    ("COPTER_MODE", 10): "OF_LOITER",
    ("COPTER_MODE", 29): "RATE_ACRO",
    ("ROVER_MODE", 2): "LEARNING",
    ("ROVER_MODE", 16): "INITIALISING",
    ("TRACKER_MODE", 16): "INITIALISING",
    **{("BLIMP_MODE", number): name for number, name in enumerate(BLIMP_MODES)},
}
"""Modes that ground stations call otherwise than the enumeration, or that it lacks."""

STANDARD_MODES: Mapping[int, Mode] = {
    1: Mode.HOLD,
    5: Mode.RETURN,
    6: Mode.MISSION,
    7: Mode.LAND,
    8: Mode.TAKEOFF,
}


@dataclass(frozen=True, slots=True)
class Flavor:
    """The autopilot that a link reports: it determines the numbers of modes and the encoding of parameters.

    `version` is the reported firmware version: major, minor, patch.
    """

    name: str
    autopilot: int
    bytewise: bool
    version: tuple[int, int, int]

    def capabilities(self, kind: VehicleKind) -> int:
        """MAV_PROTOCOL_CAPABILITY of a kind of vehicle."""
        usual = MISSION_INT | COMMAND_INT | FTP | MAVLINK2 | FENCE | POSITION_TARGETS
        return usual | (PARAM_BYTEWISE if self.bytewise else PARAM_C_CAST) | (ATTITUDE_TARGETS if kind.afloat else 0)

    @property
    def software_version(self) -> int:
        major, minor, patch = self.version
        return major << 24 | minor << 16 | patch << 8 | 255

    def custom_mode(self, kind: VehicleKind, mode: Mode) -> int:
        """The number of a mode."""
        modes = self._modes(kind)
        return modes.get(mode, modes[Mode.MANUAL])[0]

    def modes(self, kind: VehicleKind) -> list[tuple[Mode, int]]:
        """The modes of a kind of vehicle and the numbers that HEARTBEAT shows; of those with one number, the first."""
        found: dict[int, Mode] = {}
        for mode, numbers in self._modes(kind).items():
            if mode in kind.modes:
                found.setdefault(numbers[0], mode)
        return [(mode, number) for number, mode in found.items()]

    def mode(self, kind: VehicleKind, custom_mode: int) -> Mode:
        """The mode with a number."""
        return next((mode for mode, numbers in self._modes(kind).items() if custom_mode in numbers), Mode.OTHER)

    def commanded_mode_number(self, main: int, sub: int) -> int:
        """The number of the mode that MAV_CMD_DO_SET_MODE asks for."""
        return main if self.name == "ardupilot" else main << 16 | sub << 24

    def banner(self, kind: VehicleKind) -> str:
        """The first line that consoles expect."""
        firmware = {"ardupilot": kind.firmware, "px4": "PX4"}.get(self.name, "Shoal")
        return f"{firmware} V{'.'.join(map(str, self.version))} (Shoal)"

    def _modes(self, kind: VehicleKind) -> Mapping[Mode, tuple[int, ...]]:
        return kind.modes if self.name == "ardupilot" else PX4_MODES


FLAVORS: Mapping[str, Flavor] = {
    "ardupilot": Flavor("ardupilot", 3, False, (4, 1, 0)),
    "px4": Flavor("px4", 12, True, (1, 14, 0)),
    "generic": Flavor("generic", 0, True, (1, 0, 0)),
}

STATUS: Mapping[int, int] = {
    OpMode.BOOT: BOOT,
    OpMode.CALIBRATION: CALIBRATING,
    OpMode.SERVICE: STANDBY,
    OpMode.MANEUVER: ACTIVE,
    OpMode.EXTERNAL: ACTIVE,
    OpMode.ERROR: CRITICAL,
}
SINGLE: Mapping[int, Mode] = {
    imc.StationKeeping.ID: Mode.HOLD,
    imc.Loiter.ID: Mode.HOLD,
    imc.Takeoff.ID: Mode.TAKEOFF,
    imc.Land.ID: Mode.LAND,
}


def mode_name(base: int, custom: int, kind: int, autopilot: int, enumerations: Mapping[str, Mapping[int, str]]) -> str:
    """The name that ground stations use for the mode in another autopilot's HEARTBEAT; "Mode(n)" if there is none.

    `kind` is its MAV_TYPE, `autopilot` its MAV_AUTOPILOT, `enumerations` those of the dialect.
    """
    if autopilot == PX4:
        main, sub = custom >> 16 & 0xFF, custom >> 24
        return PX4_NAMES.get((main, sub if main == 4 else 0), "UNKNOWN")
    if not base & CUSTOM_MODE:
        return f"Mode({base:#010x})"
    enumeration = ARDUPILOT_MODES.get(kind, "")
    name = GROUND_STATION_NAMES.get((enumeration, custom)) or enumerations.get(enumeration, {}).get(custom)
    return name or f"Mode({custom})"


def mode_number(name: str, kind: int, flavor: Flavor, enumerations: Mapping[str, Mapping[int, str]]) -> int | None:
    """The number of a mode with a name that `mode_name` gives; None if an autopilot of the flavor has no such mode."""
    if flavor.autopilot != ARDUPILOT:
        return next((main << 16 | sub << 24 for (main, sub), known in PX4_NAMES.items() if known == name), None)
    group = ARDUPILOT_MODES.get(kind, "")
    names = {number: known for (of, number), known in GROUND_STATION_NAMES.items() if of == group}
    return next((number for number, known in {**enumerations.get(group, {}), **names}.items() if known == name), None)


def is_maneuvering(vehicle: imc.VehicleState | None) -> bool:
    """Whether the vehicle executes a maneuver or is steered, at anybody's request."""
    return vehicle is not None and vehicle.op_mode in (OpMode.MANEUVER, OpMode.EXTERNAL)


def mode_of(vehicle: imc.VehicleState | None, plan: imc.PlanControlState | None, *, aloft: bool = False) -> Mode:
    """The mode of a vehicle with these states; one that is `aloft` holds if nothing else is asked for."""
    if vehicle is None or not is_maneuvering(vehicle):
        return Mode.HOLD if aloft else Mode.MANUAL
    if vehicle.op_mode == OpMode.EXTERNAL or vehicle.maneuver_type == imc.Teleoperation.ID:
        return Mode.TELEOPERATION
    if plan is not None and plan.state in (PlanState.INITIALIZING, PlanState.EXECUTING):
        return Mode.MISSION
    mode = SINGLE.get(vehicle.maneuver_type, Mode.MISSION)
    done = vehicle.flags & imc.VehicleState.Flags.MANEUVER_DONE
    if done and (aloft or mode is Mode.LAND):
        return Mode.HOLD if aloft else Mode.MANUAL
    return mode

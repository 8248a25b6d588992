"""Names of ArduPilot and PX4 for the modes that Shoal needs, for each kind of vehicle."""

from dataclasses import dataclass, replace

ARDUPILOT, PX4 = 3, 12  # MAV_AUTOPILOT
COPTERS = frozenset({2, 3, 4, 13, 14, 15, 29, 35})  # MAV_TYPE
PLANE, ROVER, BOAT, SUBMARINE = 1, 10, 11, 12
MOVING = COPTERS | {PLANE, ROVER, BOAT, SUBMARINE}
PX4_MAIN, PX4_SUB = 1 << 16, 1 << 24
PX4_AUTO, PX4_ORBIT, PX4_OFFBOARD = 4 * PX4_MAIN, 3 * PX4_MAIN + PX4_SUB, 6 * PX4_MAIN


@dataclass(frozen=True, slots=True)
class SteeredVehicle:
    """Vehicle that an autopilot steers, and the numbers (`custom_mode`) of its modes; None for missing ones.

    `mission` is the mode in which it carries out the mission in its memory, `instead` that for a hold that is rejected.
    `flies`: it takes off, and must not be disarmed in the air. `targets`: it follows a stream of
    SET_POSITION_TARGET_GLOBAL_INT; others get one DO_REPOSITION for a leg. `offboard`: it leaves its mode, by itself,
    when this stream ends. `roams`: it cannot stand still, and circles around the end of a leg. `orbit`: the mode in
    which it circles by DO_ORBIT. `kind` is its MAV_TYPE.
    """

    name: str
    guided: int
    hold: int
    back: int
    mission: int
    land: int | None = None
    takeoff: int | None = None
    instead: int | None = None
    flies: bool = False
    targets: bool = True
    replans: bool = False
    offboard: bool = False
    roams: bool = False
    orbit: int | None = None
    px4: bool = False
    kind: int = 0

    @property
    def dives(self) -> bool:
        return self.kind == SUBMARINE

    @property
    def arming_mode(self) -> int:
        """The mode in which it is armed and takes off."""
        return self.hold if self.px4 else self.guided

    def ending_modes(self, ending: str) -> tuple[int, int | None]:
        """The mode that ends a flight by hold, return, land or disarm, and the one for when that is rejected."""
        if ending in ("land", "disarm") and self.land is not None:
            return self.land, None
        if ending == "return" or (ending != "hold" and self.flies):
            return self.back, self.land
        return self.hold, self.instead


COPTER = SteeredVehicle("copter", guided=4, hold=17, back=6, mission=3, land=9, instead=9, flies=True)
FIXED_WING = SteeredVehicle(
    "plane", guided=15, hold=12, back=11, mission=10, takeoff=13, flies=True, targets=False, roams=True
)
CAR = SteeredVehicle("rover", guided=15, hold=4, back=11, mission=10)
VESSEL = SteeredVehicle("boat", guided=15, hold=5, back=11, mission=10, instead=4)  # LOITER: in HOLD it drifts
SUB = SteeredVehicle("submarine", guided=4, hold=16, back=9, mission=3, instead=2, replans=True)  # 9: SURFACE


def steered_vehicle(autopilot: int, kind: int, *, offboard: bool = False) -> SteeredVehicle | None:
    """The vehicle with this MAV_AUTOPILOT and MAV_TYPE; None if Shoal cannot steer it.

    `offboard`: lead PX4 by setpoints; planes have no such mode for positions.
    """
    if autopilot == PX4 and kind in MOVING:
        return _px4(kind, offboard=offboard and kind != PLANE)
    if autopilot != ARDUPILOT:
        return None
    found = COPTER if kind in COPTERS else {PLANE: FIXED_WING, ROVER: CAR, BOAT: VESSEL, SUBMARINE: SUB}.get(kind)
    return found and replace(found, kind=kind)


def _px4(kind: int, *, offboard: bool) -> SteeredVehicle:
    flies, hold = kind in COPTERS or kind == PLANE, PX4_AUTO + 3 * PX4_SUB
    return SteeredVehicle(
        "PX4",
        guided=PX4_OFFBOARD if offboard else hold,
        hold=hold,
        back=PX4_AUTO + 5 * PX4_SUB,
        mission=PX4_AUTO + 4 * PX4_SUB,
        land=PX4_AUTO + 6 * PX4_SUB if flies else None,
        instead=PX4_AUTO + 6 * PX4_SUB if kind in COPTERS else None,
        takeoff=PX4_AUTO + 2 * PX4_SUB if flies else None,
        flies=flies,
        targets=offboard,
        offboard=offboard,
        roams=kind == PLANE,
        orbit=PX4_ORBIT if kind in COPTERS and not offboard else None,
        px4=True,
        kind=kind,
    )

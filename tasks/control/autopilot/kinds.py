"""What ArduPilot and PX4 call the modes that Shoal needs, for each kind of vehicle."""

from dataclasses import dataclass

ARDUPILOT, PX4 = 3, 12  # MAV_AUTOPILOT
COPTERS = frozenset({2, 3, 4, 13, 14, 15, 29, 35})  # MAV_TYPE
PLANE, ROVER, BOAT, SUBMARINE = 1, 10, 11, 12
MOVING = COPTERS | {PLANE, ROVER, BOAT, SUBMARINE}
PX4_MAIN, PX4_SUB = 1 << 16, 1 << 24
PX4_AUTO, PX4_ORBIT = 4 * PX4_MAIN, 3 * PX4_MAIN + PX4_SUB


@dataclass(frozen=True, slots=True)
class Body:
    """What an autopilot steers, and the numbers (`custom_mode`) of its modes; None for those that it lacks.

    `flies`: it takes off, and must not be disarmed in the air. `targets`: it follows a stream of
    SET_POSITION_TARGET_GLOBAL_INT; others get one DO_REPOSITION for a leg. `roams`: it cannot stand still, and
    circles around the end of a leg. `orbit`: the mode in which it circles by DO_ORBIT.
    """

    name: str
    guided: int
    hold: int
    back: int
    land: int | None = None
    takeoff: int | None = None
    flies: bool = False
    targets: bool = True
    roams: bool = False
    orbit: int | None = None
    px4: bool = False


COPTER = Body("copter", guided=4, hold=17, back=6, land=9, flies=True)
FIXED_WING = Body("plane", guided=15, hold=12, back=11, takeoff=13, flies=True, targets=False, roams=True)
CAR = Body("rover", guided=15, hold=4, back=11)
VESSEL = Body("boat", guided=15, hold=5, back=11)  # LOITER: in HOLD it drifts
SUB = Body("submarine", guided=4, hold=16, back=9)  # it comes up where it is


def body_of(autopilot: int, kind: int) -> Body | None:
    """The body with this MAV_AUTOPILOT and MAV_TYPE; None if Shoal cannot steer it."""
    flies = kind in COPTERS or kind == PLANE
    if autopilot == PX4 and kind in MOVING:
        hold = PX4_AUTO + 3 * PX4_SUB
        return Body(
            "PX4",
            guided=hold,
            hold=hold,
            back=PX4_AUTO + 5 * PX4_SUB,
            land=PX4_AUTO + 6 * PX4_SUB if flies else None,
            takeoff=PX4_AUTO + 2 * PX4_SUB if flies else None,
            flies=flies,
            targets=False,
            roams=kind == PLANE,
            orbit=PX4_ORBIT if kind in COPTERS else None,
            px4=True,
        )
    if autopilot != ARDUPILOT:
        return None
    if kind in COPTERS:
        return COPTER
    return {PLANE: FIXED_WING, ROVER: CAR, BOAT: VESSEL, SUBMARINE: SUB}.get(kind)

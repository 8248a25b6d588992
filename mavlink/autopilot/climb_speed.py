"""Check that an autopilot climbs no faster in a takeoff than planned."""

import math
from collections.abc import Callable

from mavlink.autopilot.setpoints import CHANGE_SPEED, CommandMessage, command_message
from mavlink.autopilot.vehicle_modes import SteeredVehicle

CLIMB = 2  # SPEED_TYPE
TOO_FAST, MARGIN = 1.25, 0.2  # times the speed of the plan, m/s
PERSISTENCE = 1.0  # s for which it has to be wrong
SETTLING = 3.0  # s after the command in which it slows down


class ClimbSpeed:
    """Lowers the climb of an ArduCopter that is too fast by DO_CHANGE_SPEED; reports what stays too fast, once.

    A takeoff begins with the autopilot's own speed (WPNAV_SPEED_UP, MPC_TKO_SPEED). PX4 has no command for it. A plan
    does not make it faster: its own speed is what its owner has chosen.
    """

    def __init__(self, warn: Callable[[str], object]) -> None:
        self._warn = warn
        self.restart()

    def restart(self) -> None:
        """Begin a new takeoff."""
        self._wrong_since = math.inf
        self._corrected = self._reported = False

    def correction(self, vehicle: SteeredVehicle, speed: float, climb: float, now: float) -> CommandMessage | None:
        """Compare the speed of the plan with the measured climb (m/s); returns the command that has to be sent now."""
        if climb <= TOO_FAST * speed + MARGIN:
            self._wrong_since = math.inf
            return None
        if math.isinf(self._wrong_since):
            self._wrong_since = now
        if self._reported or now - self._wrong_since < PERSISTENCE:
            return None
        if not (self._corrected or vehicle.px4):
            self._corrected, self._wrong_since = True, now + SETTLING - PERSISTENCE
            return command_message("the climb speed", CHANGE_SPEED, (CLIMB, speed, -1.0))
        self._reported = True
        self._warn(f"it climbs at {climb:.1f} m/s, not the plan's {speed:g} m/s")
        return None

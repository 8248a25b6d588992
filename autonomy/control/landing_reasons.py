"""Reason why a multirotor lands without an order: its battery is low, or nothing leads it any more."""

import math

import imc

Mode = imc.VehicleState.OpMode
UNCOMMANDED = (Mode.SERVICE, Mode.ERROR, Mode.BOOT)
LOW_BATTERY = "the battery is low"


class LandingReasons:
    """Tracks fuel level (%) and mode of the vehicle, and how long it has hovered without a maneuver."""

    def __init__(self) -> None:
        self.fuel: float = math.inf
        self.erred: bool = False
        self._mode: int = Mode.BOOT
        self._waited = 0.0

    def receive_mode(self, mode: int) -> None:
        """A mode of the vehicle; an error counts until `erred` is cleared."""
        self._mode = mode
        self.erred = self.erred or mode == Mode.ERROR

    def find(self, dt: float, lowest: float, timeouts: tuple[float, float], *, hovers: bool) -> str:
        """The reason `dt` s after the last call, or empty.

        `lowest` is the fuel level (%) below which it lands, `timeouts` are those of hovering and of hovering after an
        error (s, 0 for never), `hovers` is whether it hovers and nothing controls it.
        """
        if self.fuel < lowest:
            return LOW_BATTERY
        waits = hovers and self._mode in UNCOMMANDED
        self._waited = self._waited + dt if waits else 0.0
        limit = timeouts[1] if self.erred else timeouts[0]
        if not 0.0 < limit < self._waited:
            return ""
        if not self.erred:
            return "no maneuver"
        return "the vehicle is in error" if self._mode == Mode.ERROR else "no maneuver after an error"

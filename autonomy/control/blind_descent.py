"""Descent of a multirotor without a state: its duration, and the return to a state."""

import math

DESCENT = 1.5  # m/s
MARGIN, RECOVERY = 30.0, 3.0  # s
MEMORY = 120.0  # s; what fails again so soon is not trusted again
FALL_MARGIN = 5.0  # m
UNMEASURED, MEASURED = 2.0, 6.0  # times the time of the descent; where speed is measured, a touchdown is detected


class BlindDescent:
    """Bounds the height of the vehicle. The second descent within two minutes is `final`: it ends on the ground."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """The vehicle rests on the ground."""
        self._begun = -math.inf
        self._highest = 0.0
        self._fallen = 0.0
        self.final: bool = False

    def begin(self, now: float, altitude: float) -> None:
        """Begin at a time (s) and an altitude (m)."""
        self.final, self._begun = now - self._begun < MEMORY, now
        self._highest, self._fallen = max(0.0, altitude), 0.0

    def note_altitude(self, altitude: float) -> None:
        """The vehicle may be at an altitude (m)."""
        self._highest = max(self._highest, altitude)

    def note_fall(self, dt: float, speed: float) -> None:
        """Add a fall of `dt` s with a speed (m/s) that no sensor measures."""
        self._fallen += dt * max(0.0, speed - DESCENT)

    def trusts(self, now: float, resumed: float) -> bool:
        """Whether a state that is there again since a time (s) can be used."""
        return not self.final and now - resumed >= RECOVERY

    def has_landed(
        self, now: float, *, measured: bool, landing_altitude: float = 0.0, landing_rate: float = DESCENT
    ) -> bool:
        """Whether the vehicle is on the ground after so long a time or fall; `measured` if its vertical speed is.

        Such a vehicle may descend below an altitude (m) at another rate (m/s).
        """
        if self._fallen > self._highest + FALL_MARGIN:
            return True
        usual = self._highest / DESCENT
        if not measured:
            return now - self._begun > MARGIN + UNMEASURED * usual
        more = min(self._highest, landing_altitude) * (1.0 / min(DESCENT, landing_rate) - 1.0 / DESCENT)
        return now - self._begun > MARGIN + max(MEASURED * usual, UNMEASURED * (usual + more))

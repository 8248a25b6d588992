"""Ground stations that a vehicle receives: those whose HEARTBEAT has come lately."""

from collections.abc import Callable

import imc
from mavlink import GROUND_STATION, ReceivedMessage

TIMEOUT = 5.0  # s without HEARTBEAT, which stations send each second, after which one is out of reach


class StationsInReach:
    """Time of the last HEARTBEAT of each ground station, by its MAVLink system id.

    `age(time)` is the time (s) since then in which the program could receive something. A program on board that takes
    part in MAVLink is no station as long as its HEARTBEAT has another type.
    """

    def __init__(self, age: Callable[[float], float]) -> None:
        self._age = age
        self._received: dict[int, float] = {}

    def receive(self, message: ReceivedMessage, now: float) -> None:
        """Take a message of a station that may command."""
        if message.name == "HEARTBEAT" and message.values["type"] == GROUND_STATION:
            self._received[message.system] = now

    def announcements(self, clock_speed: float) -> tuple[imc.Announce, ...]:
        """One for each station in reach; `clock_speed` is the vehicle's seconds in one of the stations."""
        late = [number for number, time in self._received.items() if self._age(time) > TIMEOUT * clock_speed]
        for number in late:
            del self._received[number]
        return tuple(
            imc.Announce(sys_name=f"mavlink:{number}", sys_type=imc.SystemType.CCU) for number in sorted(self._received)
        )

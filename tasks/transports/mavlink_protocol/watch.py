"""What a vehicle does that its ground stations have lost."""

from collections.abc import Callable, Mapping

from mavlink import GROUND_STATION, ReceivedMessage
from tasks.transports.mavlink_protocol.errands import NO_PLACE, ignored, land, return_home
from tasks.transports.mavlink_protocol.mission import MissionState
from tasks.transports.mavlink_protocol.system import MavlinkSystem

Action = Callable[[MavlinkSystem, float], object]
ACTIONS: Mapping[str, Action] = {
    "Hold": lambda system, now: system.hold(now),
    "Return": lambda system, now: return_home(system, ignored, now),
    "Land": lambda system, now: land(system, NO_PLACE, ignored, now),
    "Stop": lambda system, now: system.helm.stop(now),
}


class Watch:
    """When a ground station was heard last; what a router brings from other vehicles is none."""

    def __init__(self, system: MavlinkSystem) -> None:
        self._system = system
        self._heard_at: float | None = None

    def hear(self, message: ReceivedMessage, now: float) -> None:
        """Take a message: the heartbeats of stations count, and what is sent to this vehicle alone."""
        values = message.values
        beat = message.name == "HEARTBEAT" and values["type"] == GROUND_STATION
        if beat or self._system.system in (values.get("target_system"), values.get("target")):
            self._heard_at = now

    def look_after(self, action: str, timeout: float, now: float) -> bool:
        """Act once after a silence of `timeout` s, if the vehicle does what a station has asked for."""
        system, heard = self._system, self._heard_at
        if heard is None or now - heard <= timeout:
            return False
        self._heard_at = None
        if not system.errand and system.mission.state is not MissionState.ACTIVE:
            return False
        system.interrupted = system.mode, system.orders
        ACTIONS[action](system, now)
        return True

"""Action of a vehicle that has lost its ground stations."""

from collections.abc import Callable, Mapping

from mavlink import GROUND_STATION, ReceivedMessage
from mavlink.vehicle.command.guided_commands import NO_PLACE, discard_result, land, return_home
from mavlink.vehicle.command.hold_and_abort import VehicleControl
from mavlink.vehicle.mission import MissionState

Action = Callable[[VehicleControl, float], object]
ACTIONS: Mapping[str, Action] = {
    "Hold": lambda control, now: control.hold(now),
    "Return": lambda control, now: return_home(control, discard_result, now),
    "Land": lambda control, now: land(control, NO_PLACE, discard_result, now),
    "Stop": lambda control, now: control.plans.stop(now),
}


class GcsFailsafe:
    """Failsafe after the silence of ground stations; messages that a router brings from other vehicles do not count."""

    def __init__(self, control: VehicleControl) -> None:
        self._control = control
        self._received_at: float | None = None

    def receive(self, message: ReceivedMessage, now: float) -> None:
        """Take a message: the heartbeats of stations count, and what is sent to this vehicle alone."""
        values = message.values
        beat = message.name == "HEARTBEAT" and values["type"] == GROUND_STATION
        if beat or self._control.model.system in (values.get("target_system"), values.get("target")):
            self._received_at = now

    def tick(self, action: str, timeout: float, now: float) -> bool:
        """Act once after a silence of `timeout` s, if the vehicle does what a station has asked for."""
        control, received_at = self._control, self._received_at
        if received_at is None or control.age(received_at) <= timeout:
            return False
        self._received_at = None
        if not control.model.active_guided_plan_id and control.mission.state is not MissionState.ACTIVE:
            return False
        control.model.interrupted = control.model.mode, control.model.command_count
        ACTIONS[action](control, now)
        return True

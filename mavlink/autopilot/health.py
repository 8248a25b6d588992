"""The health of the parts of an autopilot, from SYS_STATUS."""

from collections.abc import Callable, Mapping

import imc

State = imc.EntityState.State
NAVIGATION = "Navigation"
CRITICAL = (5, 6, 8)  # MAV_STATE: critical, emergency, flight termination
HEALTH: Mapping[str, int] = {
    "GPS": 0x20,
    "IMU": 0x01 | 0x02 | 0x04,  # gyroscopes, accelerometers, magnetometers
    "Pressure Sensor": 0x08,
    "Batteries": 0x02000000,
    NAVIGATION: 0x00200000,  # attitude and position as it estimates them
}
"""Label of an entity -> the bits (MAV_SYS_STATUS_SENSOR) that it depends on."""

Show = Callable[[str, State, str], object]


def describe_autopilot(name: str, *, armed: bool, critical: bool, counts: Mapping[str, int]) -> tuple[State, str]:
    """State and description of an autopilot: what it steers, and how many messages of each kind had no effect."""
    words = "".join(f", {count} {what}" for what, count in sorted(counts.items()) if count)
    words = f"{name}, {'armed' if armed else 'disarmed'}{words}"
    return (State.ERROR, f"reports a critical state: {words}") if critical else (State.NORMAL, words)


class SensorHealth:
    """Shows the states of entities: as the autopilot reports them, and missing reports.

    Navigation is NORMAL only while there are states of it: see `report_navigation_state`.
    """

    def __init__(self, show: Show) -> None:
        self._show = show
        self._navigation = State.NORMAL, "active"
        self._is_reported = False

    def receive(self, values: Mapping[str, int]) -> None:
        """Take SYS_STATUS."""
        self._is_reported = True
        for label in HEALTH:
            state, words = sensor_state(label, values)
            if label == NAVIGATION:
                self._navigation = (state, words) if state is State.ERROR else (State.NORMAL, "active")
            if label != NAVIGATION or state is State.ERROR:
                self._show(label, state, words)

    def report_navigation_state(self) -> None:
        """Take a new state."""
        self._show(NAVIGATION, *self._navigation)

    def report_missing_messages(self, names: list[str], seconds: float) -> None:
        """Messages without which there is no state have not come."""
        self._show(NAVIGATION, State.ERROR, f"no {' and no '.join(names)} for {seconds:g} s")

    def expire(self) -> None:
        """SYS_STATUS does not come any more: its content is outdated."""
        if self._is_reported:
            self._is_reported = False
            for label in HEALTH:
                if label != NAVIGATION:
                    self._show(label, State.ERROR, "the autopilot does not report its health")


def sensor_state(label: str, values: Mapping[str, int]) -> tuple[State, str]:
    """State and description of an entity."""
    prefix = "onboard_control_sensors"
    used = HEALTH[label] & values[f"{prefix}_present"] & values[f"{prefix}_enabled"]
    if not used:
        return State.NORMAL, "the autopilot uses none"
    return (State.NORMAL, "active") if not used & ~values[f"{prefix}_health"] else (State.ERROR, "not healthy")

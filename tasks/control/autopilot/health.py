"""The health of the parts of an autopilot, from SYS_STATUS."""

from collections.abc import Callable, Mapping

from runtime import State

NAVIGATION = "Navigation"
HEALTH: Mapping[str, int] = {
    "GPS": 0x20,
    "IMU": 0x01 | 0x02 | 0x04,  # gyroscopes, accelerometers, magnetometers
    "Pressure Sensor": 0x08,
    "Batteries": 0x02000000,
    NAVIGATION: 0x00200000,  # attitude and position as it estimates them
}
"""Label of an entity -> the bits (MAV_SYS_STATUS_SENSOR) that it depends on."""

Show = Callable[[str, State, str], object]


class Health:
    """Shows the states of entities: what the autopilot says of them, and that it does not.

    Navigation is NORMAL only while there are states of it: `navigate` says so.
    """

    def __init__(self, show: Show) -> None:
        self._show = show
        self._navigation = State.NORMAL, "active"
        self._told = False

    def hear(self, values: Mapping[str, int]) -> None:
        """Take SYS_STATUS."""
        self._told = True
        for label in HEALTH:
            state, words = health_of(label, values)
            if label != NAVIGATION:
                self._show(label, state, words)
            else:
                self._navigation = (state, words) if state is not State.NORMAL else (state, "active")

    def navigate(self) -> None:
        """There is a new state."""
        self._show(NAVIGATION, *self._navigation)

    def miss(self, names: list[str], seconds: float) -> None:
        """Messages without which there is no state have not come."""
        self._show(NAVIGATION, State.ERROR, f"no {' and no '.join(names)} for {seconds:g} s")

    def forget(self) -> None:
        """SYS_STATUS does not come any more: what it said is not true any more."""
        if self._told:
            self._told = False
            for label in HEALTH:
                if label != NAVIGATION:
                    self._show(label, State.ERROR, "the autopilot does not tell its health")


def health_of(label: str, values: Mapping[str, int]) -> tuple[State, str]:
    """State and description of an entity."""
    prefix = "onboard_control_sensors"
    used = HEALTH[label] & values[f"{prefix}_present"] & values[f"{prefix}_enabled"]
    if not used:
        return State.NORMAL, "the autopilot uses none"
    return (State.NORMAL, "active") if not used & ~values[f"{prefix}_health"] else (State.ERROR, "not healthy")

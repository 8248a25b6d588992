"""The health of the parts of an autopilot, from SYS_STATUS."""

from collections.abc import Mapping

from runtime import State

HEALTH: Mapping[str, int] = {
    "GPS": 0x20,
    "IMU": 0x01 | 0x02 | 0x04,  # gyroscopes, accelerometers, magnetometers
    "Pressure Sensor": 0x08,
    "Batteries": 0x02000000,
}
"""Label of an entity -> the bits (MAV_SYS_STATUS_SENSOR) that it depends on."""


def health_of(label: str, values: Mapping[str, int]) -> tuple[State, str]:
    """State and description of an entity."""
    prefix = "onboard_control_sensors"
    used = HEALTH[label] & values[f"{prefix}_present"] & values[f"{prefix}_enabled"]
    if not used:
        return State.NORMAL, "the autopilot uses none"
    return (State.NORMAL, "active") if not used & ~values[f"{prefix}_health"] else (State.ERROR, "not healthy")

"""The MAVLink ids of systems."""

SYSTEMS = 250  # ids of vehicles; the higher ones are those of ground stations


def mavlink_system_id(system: int) -> int:
    """The MAVLink id (1 to SYSTEMS) of an IMC system."""
    return ((system & 0xFF) - 1) % SYSTEMS + 1

"""The MAVLink ids of systems."""

SYSTEMS = 250  # ids of vehicles; the higher ones are those of ground stations


def system_of(system: int) -> int:
    """The MAVLink id (1 to SYSTEMS) of an IMC system."""
    return ((system & 0xFF) - 1) % SYSTEMS + 1

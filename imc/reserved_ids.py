"""Reserved addresses. Source: DUNE, IMC/AddressResolver and Constants."""

UNKNOWN_SYSTEM = 0xFFFF
UNKNOWN_ENTITY = 0xFF
ANNOUNCED = 0
"""The system id that an Announce is addressed to, which is for everybody."""
BROADCAST = 0xFFF0
"""The system id that addresses all systems."""

UNADDRESSED = UNKNOWN_SYSTEM, UNKNOWN_ENTITY, UNKNOWN_SYSTEM, UNKNOWN_ENTITY
"""Source and destination of a message until it is published, between its timestamp and its own fields."""
EMPTY_HEADER = -1.0, *UNADDRESSED
"""The header of a message until it is published."""

OPERATORS = range(0x4000, 0x6000)
"""System ids of consoles."""

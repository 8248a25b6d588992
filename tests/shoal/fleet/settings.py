"""What the overrides of a member of a fleet set."""

from shoal.fleet import FleetVehicle


def option(member: FleetVehicle, name: str) -> str:
    """The value of an option of any section."""
    (found,) = [text.partition("=")[2] for text in member.overrides if f":{name}=" in text]
    return found


def setting(member: FleetVehicle, section: str, name: str) -> str:
    """The value of an option, "" if it is not set."""
    found = [text.partition("=")[2] for text in member.overrides if text.startswith(f"{section}:{name}=")]
    return found[-1] if found else ""

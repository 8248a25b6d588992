"""Consoles in reach of a vehicle that do not speak IMC, such as MAVLink ground stations, in VehicleLinks."""

import imc


def has_console(links: imc.VehicleLinks) -> bool:
    """Whether one of the systems in reach is a console."""
    return any(isinstance(link, imc.Announce) and link.sys_type == imc.SystemType.CCU for link in links.links)

"""The vehicle for which a mission file becomes a plan: that of a profile, or one that has announced itself."""

import math
from collections.abc import Mapping
from dataclasses import replace

import imc
from mavlink import KINDS, home_at
from mavlink.missions import ConversionContext
from runtime.profile import Profile
from support.number_parsing import leading_number

LINK, BODY = "Transports.MAVLink", "Simulators.UAV"
KIND_OF_SYSTEM: Mapping[int, str] = {
    imc.SystemType.UUV: "submarine",
    imc.SystemType.USV: "boat",
    imc.SystemType.UAV: "hexacopter",
}


def profile_context(profile: Profile) -> ConversionContext:
    """The simulated vehicle of a profile; home is its place on the ground."""

    def number(section: str, option: str, default: float) -> float:
        try:
            return leading_number(profile.value(section, option)) if profile.value(section, option) else default
        except ValueError:
            return default  # building the vehicle reports it

    kind = KINDS.get(profile.value(LINK, "Vehicle Kind").lower(), KINDS["submarine"])
    context = ConversionContext(kind, speed=number(LINK, "Guided Speed", 0.0) or number(LINK, "Hold Speed", 1.2))
    if kind.afloat:
        return context
    undulation, ground = number(LINK, "Geoid Undulation", 0.0), number(BODY, "Ground Height", 0.0)
    texts = (section.value("Initial Position") for section in profile.config.sections.values())
    lat, lon = _place(next(filter(None, texts), profile.value("World", "Origin")))
    return replace(context, home=home_at(lat, lon, ground - undulation, afloat=False, undulation=undulation))


def announced_context(announce: imc.Announce | None) -> ConversionContext | None:
    """The kind of a vehicle that has announced itself; None if unknown. Home, and with it heights, are not known."""
    kind = KIND_OF_SYSTEM.get(announce.sys_type) if announce is not None else None
    return ConversionContext(KINDS[kind]) if kind is not None else None


def _place(text: str) -> tuple[float, float]:
    try:
        lat, lon = (math.radians(leading_number(word)) for word in text.split(","))
    except ValueError:
        return 0.0, 0.0
    return lat, lon

"""The latest values on the bus that ground stations see; what nobody reports any more is forgotten."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields

import imc

LASTING: Mapping[str, float] = {"vehicle": 3.0, "plan": 5.0, "motors": 5.0, "autopilot": 5.0, "fuel": 300.0}
USUALLY = 10.0  # s without a report until a figure is unknown


@dataclass(slots=True)
class Figures:
    """The latest values on the bus; NaN or None: unknown."""

    state: imc.EstimatedState | None = None
    vehicle: imc.VehicleState | None = None
    plan: imc.PlanControlState | None = None
    medium: int | None = None
    motors: bool | None = None
    autopilot: str = ""
    airspeed: float = math.nan
    throttle: float = math.nan
    voltage: float = math.nan
    current: float = math.nan
    fuel: float = math.nan
    load: float = math.nan
    heard: dict[str, float] = field(default_factory=dict[str, float])  # s since 1970, by name

    def take(self, name: str, value: object, now: float) -> None:
        """Take a new value."""
        setattr(self, name, value)
        self.heard[name] = now

    def forget_old(self, now: float) -> list[str]:
        """Forget what is old, and return its names. The age of EstimatedState is looked at when it is sent."""
        names = [name for name, at in self.heard.items() if now - at > LASTING.get(name, USUALLY) and name != "state"]
        defaults = {item.name: item.default for item in fields(self)}
        for name in names:
            setattr(self, name, defaults[name])
            del self.heard[name]
        return names

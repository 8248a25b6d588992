"""The latest messages on the bus that ground stations see; old ones are dropped."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import TypeVar

import imc

M = TypeVar("M", bound=imc.Message)
Measurement = imc.Voltage | imc.Current | imc.FuelLevel | imc.CpuUsage | imc.IndicatedSpeed | imc.Temperature
ShownMessages = (
    imc.EstimatedState
    | imc.VehicleState
    | imc.PlanControlState
    | imc.PathControlState
    | imc.NavigationUncertainty
    | imc.GpsFix
    | imc.Acceleration
    | imc.AngularVelocity
    | imc.MagneticField
    | imc.Pressure
    | imc.Temperature
    | imc.Distance
    | imc.Voltage
    | imc.Current
    | imc.FuelLevel
    | imc.CpuUsage
    | imc.IndicatedSpeed
    | imc.Throttle
    | imc.SetThrusterActuation
    | imc.VehicleMedium
    | imc.ArmingState
    | imc.AutopilotMode
    | imc.OperationalLimits
)
"""Messages of the bus that ground stations see."""
BATTERY = "Batter"
LANDS = "LAND"  # AutopilotMode of an aircraft that lands by itself

LASTING: Mapping[type[imc.Message], float] = {
    imc.EstimatedState: 3.0,
    imc.VehicleState: 3.0,
    imc.SetThrusterActuation: 3.0,
    imc.PathControlState: 3.0,
    imc.PlanControlState: 5.0,
    imc.ArmingState: 5.0,
    imc.AutopilotMode: 5.0,
    imc.FuelLevel: 300.0,
    imc.OperationalLimits: math.inf,
}
USUALLY = 10.0  # s without a report until a figure is unknown


class LatestValues:
    """The latest message of each kind and source; `label` is that of the entity that sends it.

    `labels()` are those of all entities: which of them are batteries decides whose voltage and current count. `age` is
    for how long (s) something was silent that came at a time.
    """

    def __init__(self, labels: Callable[[], Iterable[str]], age: Callable[[float], float]) -> None:
        self._labels, self._age = labels, age
        self._found: dict[type[imc.Message], dict[str, tuple[float, imc.Message]]] = {}

    def update(self, message: imc.Message, label: str, now: float) -> None:
        """Take a new message."""
        if isinstance(message, imc.SetThrusterActuation):
            label = f"{label} {message.id}"
        sources = self._found.setdefault(type(message), {})
        sources.pop(label, None)  # the latest is the last
        sources[label] = now, message

    def clear(self) -> None:
        """Forget all."""
        self._found.clear()

    def get(self, kind: type[M]) -> M | None:
        """The message of a kind that has come last from any source."""
        messages = list(self.by_entity(kind).values())
        return messages[-1] if messages else None

    def by_entity(self, kind: type[M]) -> dict[str, M]:
        """The messages of a kind by source, the latest last."""
        sources = self._found.get(kind, {})
        return {label: message for label, (_, message) in sources.items() if isinstance(message, kind)}

    def received_at(self, kind: type[imc.Message]) -> float | None:
        """Time at which the latest message of a kind has come, in s since 1970."""
        return max((at for at, _ in self._found.get(kind, {}).values()), default=None)

    def forget_old(self) -> list[type[imc.Message]]:
        """Forget what is old; returns the kinds of which nothing is left."""
        gone: list[type[imc.Message]] = []
        for kind, sources in list(self._found.items()):
            lasts = LASTING.get(kind, USUALLY)
            kept = {label: item for label, item in sources.items() if self._age(item[0]) <= lasts}
            if kept:
                self._found[kind] = kept
            else:
                del self._found[kind]
                gone.append(kind)
        return gone

    @property
    def state(self) -> imc.EstimatedState | None:
        """The present estimate; None if it is missing or old."""
        return self.get(imc.EstimatedState)

    @property
    def vehicle(self) -> imc.VehicleState | None:
        return self.get(imc.VehicleState)

    @property
    def plan(self) -> imc.PlanControlState | None:
        return self.get(imc.PlanControlState)

    @property
    def motors_running(self) -> bool | None:
        """Whether the motors of an aircraft run; None if unknown."""
        arming = self.get(imc.ArmingState)
        return None if arming is None else arming.state == imc.ArmingState.State.ARMED

    @property
    def is_landing(self) -> bool:
        """Whether an aircraft lands by itself."""
        mode = self.get(imc.AutopilotMode)
        return mode is not None and mode.mode == LANDS

    @property
    def voltage(self) -> float:
        """Voltage in V; if several entities measure it, the batteries count. NaN: unknown."""
        return self._of_battery(imc.Voltage)

    @property
    def current(self) -> float:
        """Current in A; NaN: unknown."""
        return self._of_battery(imc.Current)

    @property
    def fuel(self) -> float:
        """Charge in %; NaN: unknown."""
        return value_of(self.get(imc.FuelLevel))

    @property
    def airspeed(self) -> float:
        """Speed through water or air (m/s); NaN: unknown."""
        return value_of(self.get(imc.IndicatedSpeed))

    @property
    def throttle(self) -> float:
        """Throttle of the strongest thruster, in %; NaN: unknown."""
        thrusters = self.by_entity(imc.SetThrusterActuation).values()
        if (throttle := self.get(imc.Throttle)) is not None:
            return throttle.value
        return max((abs(thruster.value) * 100.0 for thruster in thrusters), default=math.nan)

    def is_battery(self, label: str) -> bool:
        """Whether an entity is a battery, or may be the supply, since none is called so."""
        return BATTERY in label or not any(BATTERY in label for label in self._labels())

    def _of_battery(self, kind: type[imc.Voltage] | type[imc.Current]) -> float:
        found = [message for label, message in self.by_entity(kind).items() if self.is_battery(label)]
        return value_of(found[-1] if found else None)


def value_of(message: Measurement | None) -> float:
    """The value of a measurement; NaN if there is none."""
    return math.nan if message is None else message.value

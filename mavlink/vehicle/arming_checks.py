"""Whether the vehicle is well, as ground stations see it: its navigation, an Abort, what keeps it from being armed."""

import math
from collections.abc import Callable, Iterable

import imc
from mavlink import CRITICAL, EMERGENCY, STANDBY, STATUS, is_maneuvering
from mavlink.vehicle.interfaces import EntityView

State = imc.EntityState.State
OpMode = imc.VehicleState.OpMode
WORKING = (OpMode.SERVICE, OpMode.MANEUVER, OpMode.EXTERNAL)
EMERGENCY_LASTS = 10.0  # s, so that a station that asks now and then sees it
ILL = (State.ERROR, State.FAILURE)


class ArmingChecks:
    """Checks of the vehicle by entities and messages; `entities` gives those whose state counts for arming.

    `aligned`: the navigation has known the position. `supervisor_silent`: VehicleState is missing. `aborted`: an Abort
    came a short time ago, or the vehicle has not recovered from it.
    """

    def __init__(self, entities: Callable[[], Iterable[EntityView]]) -> None:
        self._entities = entities
        self._navigation = ""
        self._aborted_at = -math.inf
        self.aligned: bool = False
        self.supervisor_silent: bool = False
        self.aborted: bool = False

    def update(self, message: imc.Message, label: str, now: float, *, lands: bool) -> None:
        """Take a message of the entity with this label; `lands`: the vehicle comes down by itself."""
        match message:
            case imc.EstimatedState():
                self._navigation = label
                self.aligned = self.aligned or self._state() != State.BOOT
            case imc.Abort():
                self.aborted, self._aborted_at = True, now
            case imc.VehicleState():
                self.supervisor_silent = False
                over = is_maneuvering(message) or now - self._aborted_at > EMERGENCY_LASTS
                self.aborted = self.aborted and (lands or message.op_mode == OpMode.ERROR or not over)
            case _:
                pass

    @property
    def position_trusted(self) -> bool:
        """Whether the navigation trusts the position that it publishes; one without a state is taken as right."""
        return self._state() not in (State.BOOT, *ILL)

    def prearm_failure(self, vehicle: imc.VehicleState | None) -> str:
        """Reason why the vehicle cannot be armed; empty if it can."""
        if self.supervisor_silent:
            return "VehicleState is missing"
        if vehicle is not None and vehicle.op_mode not in WORKING:
            mode = next((mode.name for mode in OpMode if mode == vehicle.op_mode), f"mode {vehicle.op_mode}")
            return f"the vehicle is in {mode}" + (f": {vehicle.error_ents}" if vehicle.error_ents else "")
        ill = next((e for e in self._entities() if e.stateful and e.state != State.NORMAL), None)
        return f"{ill.label} is in {ill.state.name}: {ill.description}" if ill else ""

    def mav_state(self, vehicle: imc.VehicleState | None) -> int:
        """MAV_STATE."""
        if self.aborted:
            return EMERGENCY
        if self.supervisor_silent or any(e.stateful and e.state in ILL for e in self._entities()):
            return CRITICAL
        return STANDBY if vehicle is None else STATUS.get(vehicle.op_mode, STANDBY)

    def _state(self) -> State | None:
        """The state of the entity that publishes the position, None if it has none."""
        found = (e.state for e in self._entities() if e.stateful and e.label == self._navigation)
        return next(found, None)

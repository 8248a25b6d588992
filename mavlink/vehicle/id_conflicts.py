"""Other systems that have the vehicle's MAVLink id, on its links or in their IMC Announce: a fault of the setup."""

from collections.abc import Callable

import imc
from imc.discovery import VEHICLE_TYPES, Services, displayable_name
from mavlink import AUTOPILOT_NONE, GROUND_STATION, ReceivedMessage, mavlink_system_id
from support.text_length import list_first

MOST = 16
FRESH = 30.0  # s for which a twin is reported after its last message
NAMED = 3  # in the state of the entity


class IdConflicts:
    """Other systems with the vehicle's id; `warn` reports the first ones, once."""

    def __init__(self, system: int, components: frozenset[int], warn: Callable[[str], object]) -> None:
        self._system = system
        self._components = components
        self._warn = warn
        self._received_at: dict[str, float] = {}

    def receive(self, message: ReceivedMessage, sender: str, now: float) -> None:
        """Take a frame; another component of the same vehicle, such as a companion computer, has its id with right."""
        if message.system != self._system:
            return
        ours = message.component in self._components
        if ours or (message.name == "HEARTBEAT" and _is_vehicle_or_station(message)):
            self.note_conflict(sender, now)

    def on_announce(self, other: imc.Announce, now: float) -> None:
        """Take the Announce of another vehicle; its id follows from its IMC id if it does not announce it."""
        theirs = Services.parse(other.services).mavlink_id or mavlink_system_id(other.src)
        if other.sys_type in VEHICLE_TYPES and theirs == self._system:
            self.note_conflict(f"{displayable_name(other.sys_name)} ({other.src:#06x})", now)

    def note_conflict(self, twin: str, now: float) -> None:
        """Take a system that has the same id."""
        if twin not in self._received_at:
            if len(self._received_at) < MOST:
                self._warn(self._words(twin))
            else:
                del self._received_at[min(self._received_at, key=self._received_at.__getitem__)]
        self._received_at[twin] = now

    def trouble(self, now: float) -> str:
        """Present conflict; empty without one."""
        fresh = [twin for twin, at in self._received_at.items() if now - at < FRESH]
        if not fresh:
            return ""
        return self._words(list_first(fresh, NAMED))

    def _words(self, who: str) -> str:
        return f"MAVLink id {self._system} is also that of {who}: set System Id"


def _is_vehicle_or_station(message: ReceivedMessage) -> bool:
    values = message.values
    return values["type"] == GROUND_STATION or values["autopilot"] != AUTOPILOT_NONE

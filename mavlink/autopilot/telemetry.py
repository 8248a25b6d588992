"""Measurements of an autopilot, as messages of IMC at the times of its measurements."""

import math
from collections.abc import Callable, Iterator, Mapping

import imc
from mavlink import Dialect, ReceivedMessage
from mavlink.autopilot.boot_clock import BootClock
from mavlink.autopilot.connection import ESSENTIAL
from mavlink.autopilot.leg import ReportedPosition
from mavlink.translate import AutopilotTranslator
from support.wgs84 import is_on_earth

LARGEST_LAT, LARGEST_LON = 900_000_000, 1_800_000_000  # 1e-7 °
SILENT_KINDS = (imc.Heartbeat,)  # the daemon has one of its own
DOWN = 25  # orientation of what measures distances
STATE = "EstimatedState"
WARNING = 4  # MAV_SEVERITY: warnings, and worse
RECENT = 5.0  # s; a text so recent may explain a rejected command
FIX_3D = 3  # GPS_FIX_TYPE
LEAST_STEP = 1e-3  # s between two states
GEOID_ERROR = 5.0  # m


class Telemetry:
    """Translates the messages of an autopilot; leaves out what is no number, no place on Earth, or older than it seems.

    undulation: height of the geoid above the ellipsoid (m). patience: s after which a position is too old. age: for how
    long (s) the autopilot was silent since a time. invalid: how many messages were left out. position: where the
    vehicle is, once it is known. flies: whether it is an aircraft. restarts: how often the autopilot has begun anew.
    """

    def __init__(self, dialect: Dialect, undulation: float, patience: float, age: Callable[[float], float]) -> None:
        self._age = age
        self.clock: BootClock = BootClock()
        self.patience = patience
        self.undulation = undulation
        self.invalid: int = 0
        self.restarts: int = 0
        self.position: ReportedPosition | None = None
        self.flies: bool = False
        self._geoid = math.nan  # as the autopilot's GPS reports it
        self._warned = False
        self._text, self._text_at = "", -math.inf
        self._translator = AutopilotTranslator(dialect)
        self._received_at: dict[str, float] = {}
        self._above_sea = 0.0  # of home
        self._airspeed = math.nan
        self._latest = -math.inf  # time of a state

    def set_vehicle_type(self, kind: int, *, flies: bool) -> None:
        """An autopilot of this MAV_TYPE has sent something."""
        self._translator.type, self.flies = kind, flies

    def is_message_overdue(self, name: str, patience: float = 0.0) -> bool:
        """Whether a message has not come for some time (s), by default that after which a position is too old."""
        return self._age(self._received_at.get(name, -math.inf)) > (patience or self.patience)

    def missing_messages(self) -> list[str]:
        """Missing messages, without which there are no states; empty if there are states."""
        if not self.is_message_overdue(STATE):
            return []
        return [name for name in ESSENTIAL if self.is_message_overdue(name)] or ["position"]

    def recent_text(self) -> str:
        """Recent text of the autopilot that may be a reason; "" without one."""
        return self._text if self._age(self._text_at) <= RECENT else ""

    def receive(self, message: ReceivedMessage, now: float) -> Iterator[tuple[str, imc.Message]]:
        """Convert a message to IMC, with the label of its entity, and the time of the measurement in its header."""
        name, values = message.name, message.values
        if name == "GLOBAL_POSITION_INT" and not self._note_place(values):
            return
        self._received_at[name] = now
        if name == "VFR_HUD":
            self._airspeed = values["airspeed"] if values["airspeed"] > 0.0 else math.nan
        if name == "DISTANCE_SENSOR" and values["orientation"] != DOWN:
            return  # what is ahead is no altitude
        if name == "STATUSTEXT" and values["severity"] <= WARNING and not values["chunk_seq"]:
            self._text, self._text_at = values["text"].decode(errors="replace"), now
        if name not in self._translator.message_names:
            return
        time, count = now, values.get("time_boot_ms")
        if count is not None:
            self.restarts += self.clock.update(count / 1e3, now)
            time = self.clock.time(count / 1e3, now)
        if name == "ATTITUDE":  # a better comparison of the clocks does not set states back
            time = self._latest = max(time, min(now, self._latest + LEAST_STEP))
        for label, translated in self._translator.translate(message, time):
            if isinstance(translated, SILENT_KINDS):
                continue
            if not is_valid_message(translated):
                self.invalid += 1
            elif isinstance(translated, imc.GpsFix):
                yield label, self._above_ellipsoid(translated, values)
            elif not isinstance(translated, imc.EstimatedState):
                yield label, translated
            elif not self.is_message_overdue("GLOBAL_POSITION_INT"):
                self._received_at[STATE] = now
                yield label, self._placed(translated)

    def _note_place(self, values: Mapping[str, int]) -> bool:
        if abs(values["lat"]) > LARGEST_LAT or abs(values["lon"]) > LARGEST_LON:
            self.invalid += 1
            return False
        self._above_sea = (values["alt"] - values["relative_alt"]) / 1e3
        return True

    def _above_ellipsoid(self, fix: imc.GpsFix, values: Mapping[str, int]) -> imc.GpsFix:
        """The fix with a height above the ellipsoid; older receivers report only that above the sea."""
        if not values["alt_ellipsoid"]:
            return fix.replace(height=fix.height + self.undulation)
        if values["fix_type"] >= FIX_3D:
            self._geoid = (values["alt_ellipsoid"] - values["alt"]) / 1e3
        return fix

    def geoid_warning(self) -> str:
        """Warning of a wrong undulation, once; "" if it may be right."""
        if self._warned or not abs(self._geoid - self.undulation) > GEOID_ERROR:
            return ""
        self._warned = True
        wrong = f"Geoid Undulation is {self.undulation:g} m, but the autopilot's GPS reports {self._geoid:.1f} m"
        return f"{wrong}: heights above the ellipsoid are wrong by the difference"

    def _placed(self, state: imc.EstimatedState) -> imc.EstimatedState:
        """The state with the heights of Shoal: above the ellipsoid, and for an aircraft above the start."""
        amsl, above = state.height, state.height - self._above_sea
        motion = state.vx, state.vy, state.vz, state.psi, self._airspeed
        self.position = ReportedPosition(state.lat, state.lon, amsl, above, *motion)
        if self.flies and state.alt < 0.0:
            state = state.replace(alt=max(0.0, above))
        return state.replace(height=amsl + self.undulation)


def is_valid_message(message: imc.Message) -> bool:
    """Whether all numbers of a message are finite, and its position is on Earth."""
    for item in imc.fields(type(message)):
        value = getattr(message, item.name)
        if isinstance(value, float) and not math.isfinite(value):
            return False
    return is_on_earth(getattr(message, "lat", 0.0), getattr(message, "lon", 0.0))

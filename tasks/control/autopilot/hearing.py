"""What an autopilot measures, as messages of IMC at the times of its measurements."""

import math
from collections.abc import Iterator, Mapping

import imc
from mavlink import AutopilotTranslator, Dialect, Received
from tasks.control.autopilot.clock import RemoteClock
from tasks.control.autopilot.leg import Whereabouts

STALE = 2.0  # s; an older position is none
LARGEST_LAT, LARGEST_LON = 900_000_000, 1_800_000_000  # 1e-7 °
SILENT_KINDS = (imc.Heartbeat,)  # the daemon has one of its own


class Hearing:
    """Translates what an autopilot says; leaves out what is no number, no place on Earth, or older than it seems.

    undulation: height of the geoid above the ellipsoid (m). unsound: how many messages were left out. at: where the
    vehicle is, once it is known. flies: whether it is an aircraft. restarts: how often the autopilot has begun anew.
    """

    def __init__(self, dialect: Dialect, undulation: float) -> None:
        self.clock = RemoteClock()
        self.undulation = undulation
        self.unsound = self.restarts = 0
        self.at: Whereabouts | None = None
        self.flies = False
        self._translator = AutopilotTranslator(dialect)
        self._heard: dict[str, float] = {}
        self._above_sea = 0.0  # of home

    def meet(self, kind: int, *, flies: bool) -> None:
        """An autopilot of this MAV_TYPE is heard."""
        self._translator.type, self.flies = kind, flies

    def silent(self, name: str, now: float) -> bool:
        """Whether a message has not come for STALE s."""
        return now - self._heard.get(name, -math.inf) > STALE

    def take(self, message: Received, now: float) -> Iterator[tuple[str, imc.Message]]:
        """What a message says, each with the label of its entity, and the time of the measurement in its header."""
        name, values = message.name, message.values
        if name == "GLOBAL_POSITION_INT" and not self._note_place(values):
            return
        self._heard[name] = now
        if name not in self._translator.kinds:
            return
        time, count = now, values.get("time_boot_ms")
        if count is not None:
            self.restarts += self.clock.hear(count / 1e3, now)
            time = self.clock.time(count / 1e3, now)
        for label, said in self._translator.hear(message, time):
            if isinstance(said, SILENT_KINDS):
                continue
            if not _is_sound(said):
                self.unsound += 1
            elif not isinstance(said, imc.EstimatedState):
                yield label, said
            elif not self.silent("GLOBAL_POSITION_INT", now):
                yield label, self._placed(said)

    def _note_place(self, values: Mapping[str, int]) -> bool:
        if abs(values["lat"]) > LARGEST_LAT or abs(values["lon"]) > LARGEST_LON:
            self.unsound += 1
            return False
        self._above_sea = (values["alt"] - values["relative_alt"]) / 1e3
        return True

    def _placed(self, state: imc.EstimatedState) -> imc.EstimatedState:
        """The state with the heights of Shoal: above the ellipsoid, and for an aircraft above the start."""
        amsl, above = state.height, state.height - self._above_sea
        self.at = Whereabouts(state.lat, state.lon, amsl, above, state.vx, state.vy, state.vz, state.psi)
        if self.flies and state.alt < 0.0:
            state = state.replace(alt=max(0.0, above))
        return state.replace(height=amsl + self.undulation)


def _is_sound(message: imc.Message) -> bool:
    """Whether all numbers of a message are finite, and its position is on Earth."""
    for item in imc.fields(type(message)):
        value = getattr(message, item.name)
        if isinstance(value, float) and not math.isfinite(value):
            return False
    lat, lon = getattr(message, "lat", 0.0), getattr(message, "lon", 0.0)
    return abs(lat) <= 0.5 * math.pi and abs(lon) <= math.pi

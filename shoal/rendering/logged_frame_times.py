"""The times at which the cameras of a run took their frames, by its log."""

import math
from collections import deque
from collections.abc import Callable, Iterable
from typing import NamedTuple

import imc
from imc.discovery import Services
from runtime.kernel import SECOND, Kernel, nanoseconds
from runtime.profile import Profile, default_label
from shoal.logs.export import OPTICS
from shoal.rerun import tick_rates

LONGEST = 30 * 86400.0  # s of a run
LONGEST_UID = 20  # digits


class LoggedFrame(NamedTuple):
    """A frame: when it was exposed (ns since 1970 UTC), its number, and the seconds until it was delivered."""

    time: int
    number: int
    latency: float


def logged_frames(schema: imc.Schema, packets: Iterable[tuple[int, bytes]]) -> dict[int, deque[LoggedFrame]]:
    """The frames of each entity that sent CameraFrame, in order of time; those whose time makes no sense are left out.

    packets: when they were published (ns), and their bytes.
    """
    found: dict[int, list[LoggedFrame]] = {}
    for published, packet in packets:
        message = schema.decode(packet)
        time, index = getattr(message, "time", math.nan), getattr(message, "index", -1)
        if index >= 0 and 0.0 <= published / SECOND - time < LONGEST:
            late = published - nanoseconds(time)
            found.setdefault(message.src_ent, []).append(LoggedFrame(nanoseconds(time), index, max(0, late) / SECOND))
    return {entity: deque(sorted(taken)) for entity, taken in found.items()}


def logged_optics(
    schema: imc.Schema, packets: Iterable[tuple[int, bytes]]
) -> dict[tuple[int, float], tuple[float, ...]]:
    """The numbers of OPTICS of the frames that CameraFrame describes.

    They are by entity and time of exposure (s since 1970 UTC). Frames of which a number is not known are left out.
    """
    found: dict[tuple[int, float], tuple[float, ...]] = {}
    for _, packet in packets:
        message = schema.decode(packet)
        optics = tuple(getattr(message, name, math.nan) for name in OPTICS)
        if all(map(math.isfinite, optics)):
            found[message.src_ent, getattr(message, "time", math.nan)] = optics
    return found


def tick_rates_by_label(profile: Profile) -> dict[str, set[float]]:
    """The rates (Hz) at which the tasks of a profile tick, by the labels of their entities."""
    found: dict[str, set[float]] = {}
    for section, rate in tick_rates(profile):
        found.setdefault(profile.config.value(section, "Entity Label", default_label(section)), set()).add(rate)
    return found


def vehicle_start_time(schema: imc.Schema, announcements: Iterable[tuple[int, bytes]], begin: float) -> float:
    """Start time (s since 1970 UTC) of the vehicle whose logs begin at `begin`, by the `uid` that it announces."""
    for _, packet in announcements:
        uid = Services.parse(getattr(schema.decode(packet), "services", "")).uid
        if uid.isdecimal() and len(uid) < LONGEST_UID and 0.0 <= begin - int(uid) / SECOND < LONGEST:
            return int(uid) / SECOND
    return begin


class FrameScheduler:
    """Calls `expose(frame)` at the time of each frame.

    The next one is asked for when one is exposed, as a camera asks for its next tick: so it comes before or after what
    else is due at that instant as it did in the run.
    """

    def __init__(self, kernel: Kernel, frames: deque[LoggedFrame], expose: Callable[[LoggedFrame], object]):
        self._kernel, self._frames, self._expose = kernel, frames, expose

    def schedule_next(self) -> None:
        if self._frames:
            self._kernel.at(self._frames[0].time, self._expose_next)

    def _expose_next(self) -> None:
        frame = self._frames.popleft()
        self.schedule_next()
        self._expose(frame)

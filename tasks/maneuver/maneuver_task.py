"""Base class of maneuvers: how one is registered, started, steered, reported, stopped and ended."""

import functools
import inspect
import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple, get_type_hints

import imc
from imc.coordinates import absolute_position
from runtime import Script, State, Task, consume, periodic
from runtime.bus import Subscription
from runtime.task import Inbox
from support.wgs84 import offset

Phase = imc.ManeuverControlState.State
Loops = imc.CLoopsMask
PathFlags = imc.DesiredPath.Flags
PathState = imc.PathControlState.Flags
ALL_LOOPS = 0xFFFFFFFF
UNKNOWN_ETA = 0xFFFF
DONE = "done"
SILENCE = 1.5  # s after which a maneuver repeats its report
SHORT = 0.5  # m; a depth or altitude that is missed by more is reported
MISSED_SCOPES = 1000  # more than others begin while a task restarts
VERTICAL: Mapping[int, str] = {imc.ZUnits.DEPTH: "depth", imc.ZUnits.ALTITUDE: "altitude"}


class ManeuverError(RuntimeError):
    """A maneuver cannot continue; ManeuverControlState reports the text."""


class Completed(Exception):
    """Raised anywhere inside `execute`: the maneuver is done."""


class PathEnd(NamedTuple):
    """The end of a path (rad, rad, m) and its speed, with the units of IMC."""

    lat: float
    lon: float
    z: float
    z_units: int
    speed: float
    speed_units: int

    @classmethod
    def from_maneuver(cls, maneuver: Any) -> "PathEnd":
        """End with the fields of a maneuver that has them all."""
        return cls(*(getattr(maneuver, name) for name in cls._fields))

    def duration(self, distance: float) -> float:
        """Time (s) for a distance (m) at this speed; infinite where the speed is no number of m/s."""
        known = self.speed_units == imc.SpeedUnits.METERS_PS and self.speed > 0.0
        return distance / self.speed if known else math.inf


class Maneuver(Task):
    """A maneuver: its message starts `execute`, and it is done when `execute` returns.

    The annotation of the argument is the message that starts the maneuver and registers it; a CustomManeuver must name
    the class. `loops` are the control loops enabled at the start, None if `execute` enables them itself.
    `next_message` delivers the messages in `subscribed` from the own system and those in `subscribed_from_others` from
    any system.
    """

    loops: ClassVar[int | None] = Loops.PATH
    subscribed: ClassVar[tuple[type[imc.Message], ...]] = (imc.PathControlState,)
    subscribed_from_others: ClassVar[tuple[type[imc.Message], ...]] = ()

    path: imc.PathControlState | None = None
    state: imc.EstimatedState | None = None

    async def execute(self, maneuver: Any, /) -> None:
        """Carry out the maneuver. Raises ManeuverError if it cannot be done."""
        raise NotImplementedError

    @classmethod
    @functools.cache
    def message_type(cls) -> type[imc.Message]:
        """The message that starts it. Raises TypeError if the argument of `execute` has no such annotation."""
        argument = list(inspect.signature(cls.execute).parameters)[1]
        hint = get_type_hints(cls.execute).get(argument)
        if not (isinstance(hint, type) and issubclass(hint, imc.Message)):
            raise TypeError(f"{cls.__name__}.execute: annotate the argument with the maneuver's message")
        return hint

    def subscribe_handlers(self) -> None:
        super().subscribe_handlers()
        self._bus.subscribe(Subscription(self.message_type(), self._begin, self))

    def start(self) -> None:
        if hasattr(self, "_scope"):  # restarted: others may have enabled loops, in scopes that it has not received
            self._scope, self._enabled = self._scope + MISSED_SCOPES, None
        else:
            self._scope = self._path_ref = 0
            self._enabled: int | None = 0
        self._script: Script | None = None
        self._last_state, self._last_state_at = imc.ManeuverControlState(state=Phase.STOPPED), self.now
        self._missed: list[str] = []
        self.publish(imc.RegisterManeuver(mid=self.message_type().ID))
        self.set_entity_state(State.NORMAL, "idle")

    @consume
    def on_stop_maneuver(self, _: imc.StopManeuver) -> None:
        if self._script is not None and not self._script.done:
            self._script.cancel()
            self.set_entity_state(State.NORMAL, "idle")
            self._publish_phase(Phase.STOPPED)

    @periodic(1.0)
    def repeat_report(self) -> None:
        """Repeat the last report if there is no new one: silence counts as a failure."""
        if self._last_state.state == Phase.EXECUTING and self.now - self._last_state_at >= SILENCE:
            self._publish_phase(Phase.EXECUTING, self._last_state.eta, self._last_state.info)

    @consume
    def record_enabled_loops(self, loops: imc.ControlLoops) -> None:
        """Record the first message of a scope only: the maneuver sends it, controllers add theirs later."""
        if loops.scope_ref > self._scope:
            self._scope = loops.scope_ref
            self._enabled = loops.mask if loops.enable else 0

    @consume
    def record_path_ref(self, path: imc.DesiredPath) -> None:
        self._path_ref = max(self._path_ref, path.path_ref)

    @property
    def is_near_end(self) -> bool:
        """Whether the vehicle is near the end of the path."""
        return self.path is not None and bool(self.path.flags & PathState.NEAR)

    def set_control_loops(self, loops: int) -> None:
        """Enable exactly these control loops, 0 for none."""
        if loops == self._enabled:
            return
        self._loop(imc.ControlLoops.Enable.DISABLE, ALL_LOOPS)
        if loops:
            self._loop(imc.ControlLoops.Enable.ENABLE, loops)
        self._enabled = loops

    def start_path(self, leg: PathEnd, *, radius: float = 0.0, flags: int = 0) -> None:
        """Start a path to the end of `leg`, or around it with a loitering `radius` (m)."""
        self._path_ref += 1
        self.path = None
        self.publish(
            imc.DesiredPath(
                path_ref=self._path_ref,
                end_lat=leg.lat,
                end_lon=leg.lon,
                end_z=leg.z,
                end_z_units=leg.z_units,
                speed=leg.speed,
                speed_units=leg.speed_units,
                lradius=radius,
                flags=flags,
            )
        )

    async def go_to_end(
        self, leg: PathEnd, *, flags: int = 0, info: str = "", after: float = 0.0, judged: bool = True
    ) -> None:
        """Steer to the end of `leg` until near; `after` is the time (s) the maneuver takes from there, inf if unknown.

        A leg that is `judged` must end at its depth, else `check_depth` reports it.
        """
        self.start_path(leg, flags=flags)
        while not self.is_near_end:
            if isinstance(await self.next_message(), imc.PathControlState):
                self.report_time_left(after, info)
        if judged and self.path is not None:
            self.check_depth(leg, self.path.z)

    def check_depth(self, leg: PathEnd, error: float) -> None:
        """Report if the vehicle is not at the depth or altitude of `leg` at its end; `error` is what is missing (m).

        The maneuver continues as in DUNE: a leg may be too short to dive, or the water too shallow. The text is in the
        log book, in the report of the maneuver when it is done, and from there in the last reply to the console.
        """
        name = VERTICAL.get(leg.z_units)
        if name is None or abs(error) <= SHORT:
            return
        self.report_missed(f"{name} {leg.z - error:.1f} m instead of {leg.z:g} m")

    def report_missed(self, text: str) -> None:
        """Report that the maneuver continues without something that it was to do."""
        self.log.warning(text)
        self._missed.append(text)

    def report_time_left(self, after: float = 0.0, info: str = "") -> None:
        """Report the time left on the path plus `after` (s); nothing at its end, which ends or changes something."""
        if self.path is not None and not self.is_near_end:
            self.report_progress(UNKNOWN_ETA if self.path.eta == UNKNOWN_ETA else self.path.eta + after, info)

    def report_progress(self, eta: float = UNKNOWN_ETA, info: str = "") -> None:
        """Report that the maneuver continues, with the time left (s)."""
        self._publish_phase(Phase.EXECUTING, max(0, math.ceil(eta)) if eta < UNKNOWN_ETA else UNKNOWN_ETA, info)

    async def next_message(self, timeout: float | None = None) -> imc.Message:
        """The next message; `path` and `state` are updated from it. Raises TimeoutError after `timeout` (s)."""
        while True:
            message = await self._inbox.next(timeout)
            if isinstance(message, imc.EstimatedState):
                self.state = message
            elif isinstance(message, imc.PathControlState):
                if message.path_ref != self._path_ref:
                    continue
                self.path = message
            return message

    async def wait_for_state(self) -> imc.EstimatedState:
        """The state of the vehicle; waits for the first EstimatedState of the maneuver."""
        while self.state is None:
            await self.next_message()
        return self.state

    async def sleep(self, seconds: float) -> None:
        """Wait for a time (s)."""
        assert self._script is not None
        await self._script.sleep(seconds)

    def north_east_from_vehicle(self, lat: float, lon: float) -> tuple[float, float]:
        """North and east (m) from the vehicle to a position (rad)."""
        if self.state is None:
            raise ManeuverError("position is unknown")
        own_lat, own_lon, _ = absolute_position(self.state)
        return offset(own_lat, own_lon, lat, lon)

    def range_to(self, leg: PathEnd) -> float:
        """Horizontal distance (m) from the vehicle to the end of `leg`."""
        return math.hypot(*self.north_east_from_vehicle(leg.lat, leg.lon))

    def _begin(self, maneuver: imc.Message) -> None:
        if isinstance(maneuver, imc.CustomManeuver) and maneuver.name != type(self).__name__:
            return
        if self._script is not None:
            self._script.cancel()
        self.path = self.state = None
        self._missed = []
        self._publish_phase(Phase.EXECUTING, UNKNOWN_ETA, "in progress")
        self.set_entity_state(State.NORMAL, "active")
        self._script = self.start_script(self._perform, maneuver)

    async def _perform(self, script: Script, maneuver: imc.Message) -> None:
        self._inbox = self._listen(script)
        try:
            _require_numbers(maneuver)
            if self.loops is not None:
                self.set_control_loops(self.loops)
            await self.execute(maneuver)
        except Completed:
            pass
        except Exception as error:
            self.set_entity_state(State.NORMAL, "idle")
            self._publish_phase(Phase.ERROR, info=str(error) or type(error).__name__)
            if isinstance(error, ManeuverError):
                return
            raise
        self.set_entity_state(State.NORMAL, "idle")
        self._publish_phase(Phase.DONE, info=missed_depths_text(self._missed) or DONE)

    def _listen(self, script: Script) -> Inbox:
        inbox = script.listen(*self.subscribed)
        inbox.add_types(*self.subscribed_from_others, others=True)
        return inbox

    def _loop(self, enable: int, mask: int) -> None:
        self._scope += 1
        self.publish(imc.ControlLoops(enable=enable, mask=mask, scope_ref=self._scope))

    def _publish_phase(self, phase: Phase, eta: int = 0, info: str = "") -> None:
        self._last_state, self._last_state_at = imc.ManeuverControlState(state=phase, eta=eta, info=info), self.now
        self.publish(self._last_state)


def missed_depths_text(missed: Sequence[str]) -> str:
    """The first of the depths that were missed, and how many more there were; empty if there were none."""
    if len(missed) < 2:
        return "".join(missed)
    return f"{missed[0]} (and {'once more' if len(missed) == 2 else f'{len(missed) - 1} more times'})"


def _require_numbers(maneuver: imc.Message) -> None:
    for item in imc.fields(type(maneuver)):
        value = getattr(maneuver, item.name)
        if isinstance(value, float) and not math.isfinite(value):
            raise ManeuverError(f"{item.name} is not a number")

"""The link to an autopilot: whose messages count, how a companion computer introduces itself, what it asks for."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Protocol

from mavlink import (
    AUTOPILOT_NONE,
    GROUND_STATION,
    Dialect,
    Fields,
    ReceivedMessage,
    Signing,
    StreamSplitter,
    encode,
    split,
)
from mavlink.autopilot.command_client import ACCEPTED, WITHDRAWN, CommandClient
from mavlink.autopilot.vehicle_modes import PX4, SUBMARINE

COMPONENT = 191  # MAV_COMP_ID_ONBOARD_COMPUTER
ONBOARD_CONTROLLER, ACTIVE = 18, 4  # MAV_TYPE, MAV_STATE
AUTOPILOT = 1  # component
REQUEST_MESSAGE, SET_MESSAGE_INTERVAL = 512, 511  # MAV_CMD
AUTOPILOT_VERSION = 148
GROUPS = (1, 2, 6, 10, 11, 12)  # MAV_DATA_STREAM: sensors, status, position, attitude, VFR_HUD, the rest
ESSENTIAL = ("ATTITUDE", "GLOBAL_POSITION_INT")
NOBODY = 0
USUAL_SYSTEM = 1  # system id of most autopilots
SOURCE_TIMEOUT = 3.0  # s; an autopilot that has sent from a port since then is not at another one

Rates = Mapping[str, float]


def message_rates(autopilot: int, kind: int, attitude: float, position: float, sensors: float) -> Rates:
    """The messages to ask an autopilot of this MAV_AUTOPILOT and MAV_TYPE for, and their rates (Hz).

    A submarine is asked for nothing that ArduSub 4.5 lacks: by a request for WIND its simulation ends (`AP_HAL::panic`
    in `GCS_MAVLINK::try_send_message`).
    """
    imu = "HIGHRES_IMU" if autopilot == PX4 else "RAW_IMU"
    own = ("WIND_COV",) if autopilot == PX4 else () if kind == SUBMARINE else ("WIND", "POSITION_TARGET_GLOBAL_INT")
    rates = {"ATTITUDE": attitude, "GLOBAL_POSITION_INT": position, "SYS_STATUS": 2.0}
    rates |= dict.fromkeys(("GPS_RAW_INT", "VFR_HUD", imu, "DISTANCE_SENSOR"), sensors)
    slow = ("EXTENDED_SYS_STATE", "SYSTEM_TIME", "BATTERY_STATUS", "SCALED_PRESSURE", "SCALED_PRESSURE2")
    return {**rates, **dict.fromkeys((*slow, *own, "MISSION_CURRENT"), 1.0)}


class FramePort(Protocol):
    """Port that frames are written to; `set_destination` chooses the sender of a datagram for that."""

    def write(self, data: bytes) -> object: ...
    def set_destination(self, piece: bytes) -> object: ...


class AutopilotConnection:
    """One autopilot, once it has sent something: it is the first on the link, or that of a `system`.

    Everything else on the link is foreign, also after a silence: the body of a vehicle does not change. So is what
    comes with its id from another port while it sends itself. With `signing`, what is not signed by the key has no
    effect. `counts` has what had none: damaged, foreign, unsigned, forged, replayed. `warn` reports others who
    use the same ids, once each; `own` is that under which ground stations see this vehicle. Commands go through
    `commands`.
    """

    def __init__(
        self,
        dialect: Dialect,
        port: FramePort,
        warn: Callable[[str], object],
        system: int = NOBODY,
        *,
        own: int = NOBODY,
        datagrams: bool = False,
        signing: Signing | None = None,
    ) -> None:
        self.dialect = dialect
        self.system: int = system
        self.component = AUTOPILOT
        self.type: int = -1
        self.autopilot: int = -1
        self.counts: Counter[str] = Counter()
        self.commands: CommandClient = CommandClient(self.send)
        self._own, self._port, self._warn, self._warned = own, port, warn, set[int]()
        self._signing = signing
        self._sign = signing.signer(COMPONENT) if signing is not None else None
        self._split = partial(split, dialect=dialect) if datagrams else StreamSplitter(dialect).feed
        self._source: object = None
        self._source_at, self._compared = 0.0, 0
        self._sequence = 0

    @property
    def has_received_heartbeat(self) -> bool:
        """Whether an autopilot has sent something."""
        return self.autopilot >= 0

    def receive(self, data: bytes, now: float) -> Iterator[ReceivedMessage]:
        """The messages of the autopilot in what has arrived."""
        messages, damages = self._split(data)
        self.counts["damaged"] += damages
        source = getattr(data, "source", None)
        for message in messages:
            fault = self._signing.reject_reason(message) if self._signing is not None else ""
            if fault:
                self.counts[fault] += 1
            elif not self._admits(message) or self._is_elsewhere(source, now):
                self.counts["foreign"] += 1
                self._warn_of_duplicate(message)
            else:
                self._source, self._source_at = source, now
                self._port.set_destination(data)
                yield message

    def _admits(self, message: ReceivedMessage) -> bool:
        """Whether a message is the autopilot's own; the first HEARTBEAT of one decides who that is."""
        if message.component != self.component or (self.system != NOBODY and message.system != self.system):
            return False
        if message.name == "HEARTBEAT":
            if self.system == NOBODY and message.system == self._own:
                return False  # what this vehicle sends to ground stations, which has come back
            kind, autopilot = message.values["type"], message.values["autopilot"]
            if not self.has_received_heartbeat and kind != GROUND_STATION and autopilot != AUTOPILOT_NONE:
                self.system, self.type, self.autopilot = message.system, kind, autopilot
            return (kind, autopilot) == (self.type, self.autopilot)
        return self.has_received_heartbeat

    def _is_elsewhere(self, source: object, now: float) -> bool:
        return None not in (source, self._source) and source != self._source and now - self._source_at <= SOURCE_TIMEOUT

    def _warn_of_duplicate(self, message: ReceivedMessage) -> None:
        """Report others with ids that must be unique."""
        if (
            message.name == "HEARTBEAT"
            and message.system == self._own
            and not self.has_received_heartbeat
            and not self._warned
        ):
            self._warned.add(NOBODY)
            remedy = "if it is one, set Autopilot Id, and another System Id for the ground stations"
            self._warn(f"system {self._own} has this vehicle's own MAVLink id, and is not its autopilot: {remedy}")
        if message.system != self.system or message.name != "HEARTBEAT":
            return
        who = {AUTOPILOT: "another autopilot has", COMPONENT: "another companion computer, 191, is in"}
        if message.component in who and message.component not in self._warned:
            self._warned.add(message.component)
            self._warn(f"{who[message.component]} the same MAVLink system id, {self.system}: give it another one")

    def is_for_us(self, reply: ReceivedMessage) -> bool:
        """Whether an answer is ours; older autopilots leave its target open."""
        to = reply.values["target_system"], reply.values["target_component"]
        return to in ((self.system, COMPONENT), (NOBODY, NOBODY))

    def send(self, name: str, fields: Fields) -> None:
        """Send a message, to the autopilot if it has a target."""
        definition = self.dialect.by_name[name]
        target = {"target_system": self.system, "target_component": self.component}
        present = {field.name for field in definition.fields}
        values = {**fields, **{key: value for key, value in target.items() if key in present and key not in fields}}
        system = self.system or USUAL_SYSTEM
        self._port.write(encode(definition, definition.pack(values), self._sequence, system, COMPONENT, self._sign))
        self._sequence = (self._sequence + 1) & 0xFF

    def send_heartbeat(self) -> None:
        """Announce the companion, also before the autopilot has sent anything: it may wait for a first message."""
        status = {"type": ONBOARD_CONTROLLER, "autopilot": AUTOPILOT_NONE, "system_status": ACTIVE}
        self.send("HEARTBEAT", {**status, "mavlink_version": 3})

    def request_messages(self, rates: Rates, now: float) -> None:
        """Ask for messages by name, each at its rate (Hz); by groups, if an essential one is rejected."""
        refused: list[str] = []

        def settle(name: str, result: int) -> None:
            if result not in (ACCEPTED, WITHDRAWN) and name in ESSENTIAL and not refused:
                refused.append(name)
                self._ask_for_groups(max(rates.values()))

        self.commands.cancel(urgent=False)
        version = {"command": REQUEST_MESSAGE, "param1": float(AUTOPILOT_VERSION)}
        self.commands.send("COMMAND_LONG", version, lambda _: None, now)
        for name, rate in rates.items():
            wanted = {"param1": float(self.dialect.by_name[name].id), "param2": 1e6 / rate if rate > 0.0 else -1.0}
            then = partial(settle, name)
            self.commands.send("COMMAND_LONG", {"command": SET_MESSAGE_INTERVAL, **wanted}, then, now)

    def _ask_for_groups(self, rate: float) -> None:
        for group in GROUPS:
            fields = {"req_stream_id": group, "req_message_rate": max(1.0, min(rate, 10.0)), "start_stop": 1}
            self.send("REQUEST_DATA_STREAM", fields)

    def send_timesync(self, now_ns: int) -> None:
        self._compared = now_ns
        self.send("TIMESYNC", {"tc1": 0, "ts1": now_ns})

    def is_our_timesync(self, stamp: int) -> bool:
        """Whether TIMESYNC with this stamp answers ours; that of others concerns their clocks."""
        return stamp == self._compared

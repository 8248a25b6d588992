"""What a companion computer tells an autopilot: that it is there, and what it wants to hear."""

from collections.abc import Callable, Mapping
from functools import partial

from mavlink import AUTOPILOT_NONE, GROUND_STATION, Dialect, Fields, Received, encode
from tasks.control.autopilot.orders import ACCEPTED, Orders

COMPONENT = 191  # MAV_COMP_ID_ONBOARD_COMPUTER
ONBOARD_CONTROLLER, ACTIVE = 18, 4  # MAV_TYPE, MAV_STATE
AUTOPILOT = 1  # component
REQUEST_MESSAGE, SET_MESSAGE_INTERVAL = 512, 511  # MAV_CMD
AUTOPILOT_VERSION = 148
GROUPS = (1, 2, 6, 10, 11, 12)  # MAV_DATA_STREAM: sensors, status, position, attitude, VFR_HUD, the rest
ESSENTIAL = ("ATTITUDE", "GLOBAL_POSITION_INT")
NOBODY = 0

Rates = Mapping[str, float]


class Connection:
    """One autopilot, once it has been heard: it is the first on the link, or that of a `system`.

    Everything else on the link is foreign, also after a silence: the body of a vehicle does not change.
    `transmit` takes frames. Commands go through `orders`.
    """

    def __init__(self, dialect: Dialect, transmit: Callable[[bytes], object], system: int = NOBODY) -> None:
        self.dialect = dialect
        self.system: int = system
        self.component = AUTOPILOT
        self.type: int = -1
        self.autopilot: int = -1
        self._transmit = transmit
        self._sequence = 0
        self.orders = Orders(self.send)

    @property
    def met(self) -> bool:
        """Whether an autopilot has been heard."""
        return self.autopilot >= 0

    def admits(self, message: Received) -> bool:
        """Whether a message is the autopilot's own; the first HEARTBEAT of one decides who that is."""
        if message.component != self.component or (self.system != NOBODY and message.system != self.system):
            return False
        if message.name == "HEARTBEAT":
            kind, autopilot = message.values["type"], message.values["autopilot"]
            if not self.met and kind != GROUND_STATION and autopilot != AUTOPILOT_NONE:
                self.system, self.type, self.autopilot = message.system, kind, autopilot
            return (kind, autopilot) == (self.type, self.autopilot)
        return self.met

    def is_for_us(self, acknowledgment: Received) -> bool:
        """Whether a COMMAND_ACK is ours; older autopilots leave the target open."""
        to = acknowledgment.values["target_system"], acknowledgment.values["target_component"]
        return to in ((self.system, COMPONENT), (NOBODY, NOBODY))

    def send(self, name: str, fields: Fields) -> None:
        """Send a message, to the autopilot if it has a target."""
        definition = self.dialect.by_name[name]
        target = {"target_system": self.system, "target_component": self.component}
        present = {field.name for field in definition.fields}
        values = {**fields, **{key: value for key, value in target.items() if key in present and key not in fields}}
        self._transmit(encode(definition, definition.pack(values), self._sequence, self.system, COMPONENT))
        self._sequence = (self._sequence + 1) & 0xFF

    def beat(self) -> None:
        """Tell that the companion is there; nothing before the autopilot is known, whose id it shares."""
        if self.system != NOBODY:
            status = {"type": ONBOARD_CONTROLLER, "autopilot": AUTOPILOT_NONE, "system_status": ACTIVE}
            self.send("HEARTBEAT", {**status, "mavlink_version": 3})

    def ask_for(self, rates: Rates, now: float) -> None:
        """Ask for messages by name, each at its rate (Hz); by groups, if an essential one is refused."""
        refused: list[str] = []

        def settle(name: str, result: int) -> None:
            if result != ACCEPTED and name in ESSENTIAL and not refused:
                refused.append(name)
                self._ask_for_groups(max(rates.values()))

        version = {"command": REQUEST_MESSAGE, "param1": float(AUTOPILOT_VERSION)}
        self.orders.give("COMMAND_LONG", version, lambda _: None, now)
        for name, rate in rates.items():
            wanted = {"param1": float(self.dialect.by_name[name].id), "param2": 1e6 / rate if rate > 0.0 else -1.0}
            then = partial(settle, name)
            self.orders.give("COMMAND_LONG", {"command": SET_MESSAGE_INTERVAL, **wanted}, then, now)

    def _ask_for_groups(self, rate: float) -> None:
        for group in GROUPS:
            fields = {"req_stream_id": group, "req_message_rate": max(1.0, min(rate, 10.0)), "start_stop": 1}
            self.send("REQUEST_DATA_STREAM", fields)

    def compare_clocks(self, now_ns: int) -> None:
        self.send("TIMESYNC", {"tc1": 0, "ts1": now_ns})

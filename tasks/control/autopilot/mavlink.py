"""An ArduPilot or PX4 autopilot as the body of a vehicle."""

import math
from collections import Counter
from collections.abc import Mapping
from functools import partial

import imc
from mavlink import ARMED, ENTITIES, Fields, Received, StreamSplitter, load_dialect, split
from runtime import ParameterError, State, Task, consume, expect, param, periodic
from runtime.devices import Device
from runtime.vehicle import general_number
from tasks.control.autopilot.address import Place, parse_place
from tasks.control.autopilot.connection import ESSENTIAL, Connection
from tasks.control.autopilot.health import HEALTH, health_of
from tasks.control.autopilot.hearing import STALE, Hearing
from tasks.control.autopilot.kinds import SUBMARINE, body_of
from tasks.control.autopilot.leg import Leg, Reach, height_above_home
from tasks.control.autopilot.orders import Then
from tasks.control.autopilot.pilot import Errand, Pilot
from tasks.control.loops import EnabledLoops
from tasks.control.path.divergence import AlongTrack, Divergence

Loops = imc.CLoopsMask
Status = imc.ArmingState.State
REPEAT = 5.0  # s after which messages that do not come are asked for again
RECENT = 5.0  # s; a text so recent may say why a command was refused
TICK = 5.0  # Hz; how often targets are sent
REPORTS = 1.0  # s
LOUD = 4  # MAV_SEVERITY: warnings, and worse
STUCK = AlongTrack(20.0, 0.05, 0.0)
PATH_CONTROL = "Path Control"  # the entity that shows whether a path can be followed


class MAVLink(Task):
    """Makes an autopilot the body of the vehicle: its measurements become messages, and it follows DesiredPath.

    While the loop PATH is enabled, each path becomes targets for ArduPilot's GUIDED mode, or a DO_REPOSITION for PX4
    and planes; it also takes off and lands. A mode that a pilot or a failsafe of the autopilot chooses is not fought:
    the plan ends. When no maneuver leads it, it holds; after an Abort, or for an aircraft after `Idle Timeout`, it does
    what `Ending` says.
    """

    external = True
    requires = "mavlink"

    address: str = param(
        "udpin://127.0.0.1:14560",
        "",
        "Where it is: udpin://, udpout://, tcpout://HOST:PORT or serial:///DEVICE?baud=.",
        editable=False,
    )
    autopilot_id: int = param(
        0, "1", "MAVLink system id of the autopilot; 0 is the first that is heard.", minimum=0, maximum=255,
        editable=False,
    )  # fmt: skip
    input_timeout: float = param(3.0, "s", "Without HEARTBEAT for this time the autopilot is lost.", minimum=1.5)
    attitude_rate: float = param(10.0, "Hz", "Rate of EstimatedState.", minimum=1, maximum=100)
    position_rate: float = param(5.0, "Hz", "Rate of positions.", minimum=1, maximum=50)
    sensor_rate: float = param(2.0, "Hz", "Rate of GpsFix and of other measurements.", minimum=0.1, maximum=50)
    geoid_undulation: float = param(
        0.0, "m", "Height of the geoid above the ellipsoid.", minimum=-120, maximum=100, editable=False
    )
    near_radius: float = param(
        2.0, "m", "A path is done within this distance of its end.", name="Radius To Endpoint", minimum=0.1
    )
    height_tolerance: float = param(0.4, "m", "A path is done within this distance of its height.", minimum=0.1)
    ending: str = param("hold", "", "What it does after an Abort.", choices=("hold", "return", "land", "disarm"))
    idle_timeout: float = param(
        60.0, "s", "An aircraft ends its flight after this time without a maneuver; 0 for never.", minimum=0
    )

    def configure(self) -> None:
        try:
            self._place = parse_place(self.address)
        except ValueError as error:
            raise ParameterError("Address", str(error)) from None
        self._parts = {label: self.reserve(label) for label in (PATH_CONTROL, *ENTITIES[1:])}
        self._highest = general_number(self.vehicle.profile, "Absolute Maximum Altitude", math.inf)

    def start(self) -> None:
        dialect = load_dialect()
        self.counts: Counter[str] = Counter()
        datagrams = self._place.scheme.startswith("udp")
        self._split = partial(split, dialect=dialect) if datagrams else StreamSplitter(dialect).feed
        self._hearing = Hearing(dialect, self.geoid_undulation)
        self._loops = EnabledLoops(Loops.PATH)
        self._text, self._text_at = "", -math.inf
        self._limit = math.inf
        self._beaten = self._asked = self._reported = -math.inf
        self._lost = False
        self._divergence = Divergence(STUCK, None)
        self.device = self._open(self._place)
        self.connection = Connection(dialect, self.device.write, self.autopilot_id)
        self.pilot = Pilot(self._command, self.connection.send, self.log.warning, self._why)
        self.set_entity_state(State.BOOT, f"waiting for an autopilot at {self.address}")

    def _open(self, place: Place) -> Device:
        if place.scheme == "serial":
            return self.serial(place.device, place.baud, frames=self.hear)
        if place.scheme == "tcpout":
            return self.tcp(place.host, place.port, frames=self.hear)
        if place.scheme == "udpout":
            own = "::" if ":" in place.host else "0.0.0.0"
            return self.udp(0, frames=self.hear, address=own, to=(place.host, place.port))
        return self.udp(place.port, frames=self.hear, address=place.host)

    def hear(self, data: bytes) -> None:
        """Take bytes from the autopilot, and from whoever else is on the link."""
        messages, damages = self._split(data)
        self.counts["damaged"] += damages
        for message in messages:
            if self.connection.admits(message):
                self.device.answer(data)
                self._take(message)
            else:
                self.counts["foreign"] += 1

    def _take(self, message: Received) -> None:
        name, values = message.name, message.values
        if name == "HEARTBEAT":
            self.note_beat(values)
        elif name == "COMMAND_ACK":
            if self.connection.is_for_us(message):
                self.connection.orders.hear(values["command"], values["result"], self.now)
        elif name == "TIMESYNC":
            if values["tc1"] > 0:
                self._hearing.clock.compare(values["ts1"] / 1e9, values["tc1"] / 1e9, self.now)
        elif name == "EXTENDED_SYS_STATE":
            self.pilot.landed_state = values["landed_state"]
        elif name == "SYS_STATUS":
            self._judge_parts(values)
        elif name == "STATUSTEXT" and values["severity"] <= LOUD:
            self._text, self._text_at = values["text"].decode(errors="replace"), self.now
        self._translate(message)

    @expect(every="input_timeout")
    def note_beat(self, values: Mapping[str, int]) -> None:
        """Take a HEARTBEAT: mode and arming."""
        pilot, first = self.pilot, self._beaten == -math.inf
        if first:
            pilot.body = body_of(values["autopilot"], values["type"])
            self._hearing.meet(values["type"], flies=pilot.body is not None and pilot.body.flies)
            self.log.info(f"the autopilot is {self.connection.system}: {pilot.body.name if pilot.body else 'unknown'}")
        before = pilot.mode, pilot.armed
        self._beaten = self.now
        pilot.mode, pilot.armed = values["custom_mode"], bool(values["base_mode"] & ARMED)
        if first or self._lost:
            self._lost = False
            pilot.meet(pilot.mode, pilot.armed, self.now)
            self.connection.compare_clocks(self.now_ns)
            self._ask()
        self.publish(imc.ArmingState(state=Status.ARMED if pilot.armed else Status.DISARMED))
        if before != (pilot.mode, pilot.armed):
            self._act()

    def _translate(self, message: Received) -> None:
        restarts = self._hearing.restarts
        for label, said in self._hearing.take(message, self.now):
            entity = self.entity if label == ENTITIES[0] else self._parts.get(label)
            if entity is None:
                continue
            self.publish(said, keep_time=True, entity=entity)
            if isinstance(said, imc.EstimatedState):
                self.set_entity_state(State.NORMAL, "active", entity=entity)
                self._steer()
        if self._hearing.restarts > restarts:
            self.log.warning("the autopilot has started anew")
            self._ask()

    def _steer(self) -> None:
        """See how far the vehicle has come."""
        pilot, at = self.pilot, self._hearing.at
        pilot.at = at
        leg = pilot.leg
        if leg is None or at is None:
            return
        arrived = leg.advance(at, Reach(self.near_radius, self.height_tolerance))
        if arrived:
            self._act()
        where = leg.progress(at)
        if leg.near or leg.loitering or leg.arrived:
            self._divergence.restart(self.now)
        elif error := self._divergence.error(self.now, where, where.course, 0.0):
            pilot.refuse(error)
            return
        if arrived or self.now - self._reported >= REPORTS:
            self._reported = self.now
            self.publish(leg.report(at))

    @consume
    def enable(self, loops: imc.ControlLoops) -> None:
        if self._loops.hear(loops) and not self._loops.mask:
            self.pilot.release(self.now)

    @consume
    def limit(self, limits: imc.OperationalLimits) -> None:
        highest = limits.max_altitude if limits.mask & imc.OpLimitsMask.MAX_ALT else math.inf
        self._limit = highest if highest >= 0.0 else self._limit

    @consume
    def begin(self, path: imc.DesiredPath) -> None:
        """Follow a path."""
        pilot = self.pilot
        if not self._loops.mask:
            return
        if pilot.body is None or pilot.at is None:
            pilot.refuse("the autopilot is unknown, or its position is")
            return
        body, at = pilot.body, pilot.at
        dives = self.connection.type == SUBMARINE
        try:
            height = height_above_home(path, at, self.geoid_undulation, flies=body.flies, dives=dives)
            pilot.follow(Leg(path, at, min(height, self._highest, self._limit)), self.now)
        except ValueError as error:
            pilot.refuse(str(error))
            return
        self._divergence.restart(self.now)
        self._reported = -math.inf
        self.publish(imc.DesiredSpeed(value=path.speed, speed_units=path.speed_units))
        self.publish(imc.DesiredZ(value=path.end_z, z_units=path.end_z_units))

    @consume(others=True)
    def abort(self, abort: imc.Abort) -> None:
        """End the flight; but one of the vehicle itself does not interrupt a pilot whom Shoal does not lead."""
        if self.addressed(abort) and not (abort.src == self.system and self.pilot.errand is Errand.NONE):
            self._loops.mask = 0
            self.pilot.end(self.ending, self.now)
            self._act()

    @periodic(TICK)
    def work(self) -> None:
        """Do what is due, and judge how the autopilot is."""
        self.connection.orders.look_after(self.now)
        pilot = self.pilot
        if self.connection.met and not self._lost and self.now - self._beaten > self.input_timeout:
            self._lose()
        idles = pilot.errand is Errand.HOLD and pilot.body is not None and pilot.body.flies and pilot.armed
        if idles and 0.0 < self.idle_timeout < self.now - pilot.since:
            self.log.warning(f"no maneuver for {self.idle_timeout:g} s: {self.ending}")
            pilot.end(self.ending, self.now)
        self._act()

    @periodic(1.0)
    def beat(self) -> None:
        """Tell that Shoal is there, compare the clocks, and ask again for what does not come."""
        self.connection.beat()
        if not self.connection.met or self._lost:
            return
        self.connection.compare_clocks(self.now_ns)
        missing = [name for name in ESSENTIAL if self._hearing.silent(name, self.now)]
        late = self.now - self._asked > REPEAT
        if missing and late:
            self._ask()
        if missing and (late or self._parts["Navigation"].state is State.NORMAL):
            self._mark("Navigation", State.ERROR, f"no {' and no '.join(missing)} for {STALE:g} s")

    def _act(self) -> None:
        """Let the pilot do what is next, and show how it is going."""
        if self.connection.met and not self._lost:
            self.pilot.step(self.now)
            error = self.pilot.error
            self._mark(PATH_CONTROL, State.ERROR if error else State.NORMAL, error or self.pilot.errand.name.lower())
            self.set_entity_state(State.NORMAL, self._words())

    def _words(self) -> str:
        pilot = self.pilot
        name = pilot.body.name if pilot.body is not None else "unknown, cannot be steered"
        numbers = {**self.counts, "unsound": self._hearing.unsound}
        counts = "".join(f", {count} {what}" for what, count in sorted(numbers.items()) if count)
        return f"{name}, {'armed' if pilot.armed else 'disarmed'}{counts}"

    def _lose(self) -> None:
        """The autopilot has fallen silent."""
        self._lost = True
        self.pilot.lose(self.now)
        self.connection.orders.forget()
        words = f"no HEARTBEAT of the autopilot for {self.input_timeout:g} s"
        self.log.error(words)
        self.set_entity_state(State.ERROR, words)
        for label, entity in self._parts.items():
            if entity.stateful:
                self._mark(label, State.ERROR, "the autopilot is silent")

    def _ask(self) -> None:
        """Ask the autopilot for its messages."""
        self._asked, sensors = self.now, self.sensor_rate
        self.connection.orders.forget()
        self.pilot.retry()
        rates = {"ATTITUDE": self.attitude_rate, "GLOBAL_POSITION_INT": self.position_rate, "SYS_STATUS": 2.0}
        rates |= dict.fromkeys(("GPS_RAW_INT", "VFR_HUD", "RAW_IMU", "DISTANCE_SENSOR"), sensors)
        slow = ("EXTENDED_SYS_STATE", "SYSTEM_TIME", "BATTERY_STATUS", "SCALED_PRESSURE", "SCALED_PRESSURE2")
        self.connection.ask_for({**rates, **dict.fromkeys(slow, 1.0)}, self.now)

    def _judge_parts(self, values: Mapping[str, int]) -> None:
        """Show the health of sensors as the states of their entities."""
        for label in HEALTH:
            self._mark(label, *health_of(label, values))

    def _mark(self, label: str, state: State, words: str) -> None:
        self.set_entity_state(state, words, entity=self._parts[label])

    def _command(self, message: str, fields: Fields, then: Then) -> None:
        self.connection.orders.give(message, fields, then, self.now, urgent=True)

    def _why(self) -> str:
        return self._text if self.now - self._text_at <= RECENT else ""

"""An ArduPilot or PX4 autopilot as the body of a vehicle."""

import math
from collections.abc import Mapping
from pathlib import Path

import imc
from autonomy.control import EnabledLoops
from mavlink import ARMED, Fields, ReceivedMessage, Signing, SigningTime, load_dialect, read_key, system_of
from mavlink.translate import ENTITIES
from runtime import ParameterError, State, Task, consume, expect, param, periodic
from runtime.vehicle import general_number
from tasks.control.autopilot.address import open_device, parse_place
from tasks.control.autopilot.aiding import fix_of, gps_input, is_usable
from tasks.control.autopilot.connection import Connection, rates_of
from tasks.control.autopilot.health import CRITICAL, NAVIGATION, Health, in_words
from tasks.control.autopilot.hearing import Hearing
from tasks.control.autopilot.kinds import PX4, body_of
from tasks.control.autopilot.leg import Leg, Reach, height_above_home
from tasks.control.autopilot.memory import Memory
from tasks.control.autopilot.mission import Writer, approach
from tasks.control.autopilot.orders import Then
from tasks.control.autopilot.pilot import Errand, Pilot
from tasks.control.autopilot.planbook import PlanBook
from tasks.control.autopilot.progress import Progress

Loops = imc.CLoopsMask
Status = imc.ArmingState.State
REPEAT = 5.0  # s after which messages that do not come are asked for again
TICK = 5.0  # Hz; how often targets are sent
STALE = 2.0 / 3.0  # of Input Timeout; an older position is none
FORGOTTEN = 10.0  # s after which a health that is not repeated is unknown
USBL = "USBL"
PATH_CONTROL = "Path Control"  # the entity that shows whether a path can be followed


class MAVLink(Task):
    """Makes an autopilot the body of the vehicle: its measurements become messages, and it follows DesiredPath.

    While the loop PATH is enabled, each path becomes targets for ArduPilot's GUIDED mode or PX4's OFFBOARD, or a
    DO_REPOSITION for PX4 and planes, or an item of a mission in the autopilot's memory; it also takes off and lands. A
    mode that a pilot or a failsafe of the autopilot chooses is not fought: the plan ends. When no maneuver leads it, it
    holds; after an Abort, or for an aircraft after `Idle Timeout`, it does what `Ending` says.
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

    px4_guidance: str = param(
        "hold", "", "How PX4 is led: by commands in its mode hold, or by a stream of setpoints in offboard.",
        name="PX4 Guidance", choices=("hold", "offboard"), editable=False,
    )  # fmt: skip
    uploads: bool = param(
        False, "", "Whether each plan is put into the autopilot's memory, and goes on if this computer fails.",
        name="Plans In Memory", editable=False,
    )  # fmt: skip
    approach_length: float = param(400.0, "m", "Length of a plane's straight way down.", minimum=50, maximum=5000)
    approach_height: float = param(30.0, "m", "Height at its beginning, above home.", minimum=5, maximum=500)
    landing_course: float = param(
        -1.0, "°", "Course of a plane that lands, such as that of a runway; -1 is against the wind.", minimum=-1,
        maximum=360,
    )  # fmt: skip
    aiding_entity: str = param(
        "", "", "Entity whose GpsFix, or USBL fixes of this vehicle if it is USBL, are the autopilot's GPS.",
        editable=False,
    )  # fmt: skip

    def configure(self) -> None:
        try:
            self._place = parse_place(self.address)
            self._key = read_key(Path(self._place.key).expanduser()) if self._place.key else b""
        except (ValueError, OSError, RuntimeError) as error:
            raise ParameterError("Address", str(error)) from None
        self._parts = {label: self.reserve(label) for label in (PATH_CONTROL, *ENTITIES[1:])}
        self._highest = general_number(self.vehicle.profile, "Absolute Maximum Altitude", math.inf)

    def start(self) -> None:
        dialect = load_dialect()
        self._hearing = Hearing(dialect, self.geoid_undulation, STALE * self.input_timeout)
        self._condition = Health(self._mark)
        self._loops = EnabledLoops(Loops.PATH)
        self._limit = math.inf
        self._beaten = self._asked = -math.inf
        self._lost = self._critical = False
        self._wind: imc.EstimatedStreamVelocity | None = None
        self._progress = Progress()
        self.device = open_device(self, self._place, self.hear)
        self.connection = Connection(
            dialect,
            self.device,
            self.log.warning,
            self.autopilot_id,
            own=system_of(self.system),
            datagrams=self._place.scheme.startswith("udp"),
            signing=Signing(self._key, SigningTime(lambda: self.now)) if self._key else None,
        )
        memory = Memory(self.connection.send)
        self._book = PlanBook(memory, uploads=self.uploads)
        self.pilot = Pilot(
            self._command, self.connection.send, self.log.warning, lambda: self._hearing.why(self.now), memory
        )
        self.set_entity_state(State.BOOT, f"waiting for an autopilot at {self.address}")

    def hear(self, data: bytes) -> None:
        """Take bytes from the autopilot, and from whoever else is on the link."""
        for message in self.connection.hear(data, self.now):
            self._take(message)

    def _take(self, message: ReceivedMessage) -> None:
        name, values = message.name, message.values
        if name == "HEARTBEAT":
            self.note_beat(values)
        elif name == "COMMAND_ACK":
            if self.connection.is_for_us(message):
                self.connection.orders.hear(values["command"], values["result"], self.now)
        elif name == "TIMESYNC":
            if values["tc1"] > 0 and self.connection.asked_time(values["ts1"]):
                self._hearing.clock.compare(values["ts1"] / 1e9, values["tc1"] / 1e9, self.now)
        elif name == "EXTENDED_SYS_STATE":
            self.pilot.landed_state = values["landed_state"]
        elif name == "SYS_STATUS":
            self._condition.hear(values)
        elif name.startswith("MISSION_") and ("target_system" not in values or self.connection.is_for_us(message)):
            self.pilot.memory.hear(name, values, self.now)
        self._translate(message)

    @expect(every="input_timeout")
    def note_beat(self, values: Mapping[str, int]) -> None:
        """Take a HEARTBEAT: mode and arming."""
        pilot, first = self.pilot, self._beaten == -math.inf
        if first:
            offboard = self.px4_guidance == "offboard"
            pilot.body = body_of(values["autopilot"], values["type"], offboard=offboard)
            pilot.memory.first = 0 if values["autopilot"] == PX4 else 1
            self._hearing.meet(values["type"], flies=pilot.body is not None and pilot.body.flies)
            self.log.info(f"the autopilot is {self.connection.system}: {pilot.body.name if pilot.body else 'unknown'}")
        before = pilot.mode, pilot.armed
        self._beaten = self.now
        pilot.mode, pilot.armed = values["custom_mode"], bool(values["base_mode"] & ARMED)
        self._critical = values["system_status"] in CRITICAL
        if first or self._lost:
            self._lost = False
            pilot.meet(pilot.mode, pilot.armed, self.now)
            self.connection.compare_clocks(self.now_ns)
            self._ask()
        self.publish(imc.ArmingState(state=Status.ARMED if pilot.armed else Status.DISARMED))
        if before != (pilot.mode, pilot.armed):
            self._act()

    def _translate(self, message: ReceivedMessage) -> None:
        restarts = self._hearing.restarts
        for label, said in self._hearing.take(message, self.now):
            entity = self.entity if label == ENTITIES[0] else self._parts.get(label)
            if entity is None:
                continue
            self.publish(said, keep_time=True, entity=entity)
            if isinstance(said, imc.EstimatedState):
                self._condition.navigate()
                self._steer()
            elif isinstance(said, imc.EstimatedStreamVelocity):
                self._wind = said
        if self._hearing.restarts > restarts:
            self.log.warning("the autopilot has started anew")
            self._book.forget()
            self._ask()
        if doubt := self._hearing.doubt():
            self.log.warning(doubt)

    def _steer(self) -> None:
        """See how far the vehicle has come."""
        pilot, at = self.pilot, self._hearing.at
        pilot.at = at
        leg = pilot.leg
        if leg is None or at is None:
            return
        reach = Reach(self.near_radius, self.height_tolerance)
        done = leg.item is not None and pilot.memory.is_past(leg.item)
        arrived, report = self._progress.look(leg, at, reach, self.now, done=done, waits=pilot.waits)
        if self._progress.error:
            pilot.refuse(self._progress.error)
        if arrived:
            self._act()
        if report is not None:
            self.publish(report)

    @consume
    def enable(self, loops: imc.ControlLoops) -> None:
        if self._loops.receive(loops) and not self._loops.mask:
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
        try:
            height = height_above_home(path, at, self.geoid_undulation, flies=body.flies, dives=body.dives)
            leg = Leg(path, at, min(height, self._highest, self._limit))
            self._book.find(leg, self._writer, self.now, roams=body.roams)
            pilot.follow(leg, self.now)
        except ValueError as error:
            pilot.refuse(str(error))
            return
        self._progress.begin(self.now)
        self.publish(imc.DesiredSpeed(value=path.speed, speed_units=path.speed_units))
        self.publish(imc.DesiredZ(value=path.end_z, z_units=path.end_z_units))

    @consume
    def remember(self, plan: imc.PlanSpecification) -> None:
        """Put the plan that begins into the autopilot's memory."""
        self._book.begin(plan, self._writer, self.now)

    def _writer(self) -> Writer:
        """Makes missions. Raises ValueError without a position."""
        pilot = self.pilot
        if pilot.body is None or pilot.at is None:
            raise ValueError("the autopilot is unknown, or its position is")
        course = math.radians(self.landing_course) if self.landing_course >= 0.0 else None
        final = approach(self.approach_length, self.approach_height, course, self._wind, pilot.at)
        return Writer(pilot.body, pilot.at, self.geoid_undulation, final)

    @consume
    def aid(self, fix: imc.GpsFix) -> None:
        """Give the autopilot the position of another sensor."""
        if self.aiding_entity and self.vehicle.entities.label(self.system, fix.src_ent) == self.aiding_entity:
            self._aid(fix)

    @consume(others=True)
    def aid_from_afar(self, fix: imc.UsblFixExtended) -> None:
        """Give it what a ship's USBL says of this vehicle."""
        if self.aiding_entity == USBL and fix.target == self.system_name:
            self._aid(fix_of(fix, self.geoid_undulation))

    def _aid(self, fix: imc.GpsFix) -> None:
        if self.connection.met and not self._lost and is_usable(fix):
            self.connection.send("GPS_INPUT", gps_input(fix, self.geoid_undulation, self.now))

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
        self.pilot.memory.look_after(self.now)
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
        if self._hearing.silent("SYS_STATUS", self.now, FORGOTTEN):
            self._condition.forget()
        missing = self._hearing.missing(self.now)
        late = self.now - self._asked > REPEAT
        if missing and late:
            self._ask()
        if missing:
            self.pilot.at = None  # where it was is no place to steer from
        if missing and (late or self._parts[NAVIGATION].state is State.NORMAL):
            self._condition.miss(missing, self._hearing.patience)

    def _act(self) -> None:
        """Let the pilot do what is next, and show how it is going."""
        if self.connection.met and not self._lost:
            self.pilot.step(self.now)
            error = self.pilot.error
            self._mark(PATH_CONTROL, State.ERROR if error else State.NORMAL, error or self.pilot.errand.name.lower())
            if self.device.is_open:
                self.set_entity_state(*self._described())

    def _described(self) -> tuple[State, str]:
        pilot, counts = self.pilot, {**self.connection.counts, "unsound": self._hearing.unsound}
        name = pilot.body.name if pilot.body is not None else "unknown, cannot be steered"
        return in_words(name, armed=pilot.armed, critical=self._critical, counts=counts)

    def _lose(self) -> None:
        """The autopilot has fallen silent."""
        self._lost = True
        self.pilot.lose(self.now)
        self.connection.orders.forget()
        self._book.forget()
        words = f"no HEARTBEAT of the autopilot for {self.input_timeout:g} s"
        self.log.error(words)
        self.set_entity_state(State.ERROR, words)
        for label, entity in self._parts.items():
            if entity.stateful:
                self._mark(label, State.ERROR, "the autopilot is silent")

    def _ask(self) -> None:
        """Ask the autopilot for its messages."""
        self._asked = self.now
        rates = rates_of(self.connection.autopilot, self.attitude_rate, self.position_rate, self.sensor_rate)
        self.connection.ask_for(rates, self.now)

    def _mark(self, label: str, state: State, words: str) -> None:
        self.set_entity_state(state, words, entity=self._parts[label])

    def _command(self, message: str, fields: Fields, then: Then) -> None:
        self.connection.orders.give(message, fields, then, self.now, urgent=True)

"""An ArduPilot or PX4 autopilot as the body of a vehicle."""

import math
from collections.abc import Mapping
from pathlib import Path

import imc
from autonomy.control import EnabledLoops
from mavlink import ARMED, Fields, ReceivedMessage, Signing, SigningTime, load_dialect, mavlink_system_id, read_key
from mavlink.autopilot import (
    CRITICAL,
    NAVIGATION,
    PX4,
    ArrivalTolerance,
    AutopilotConnection,
    GuidedGoal,
    HeartbeatWatch,
    Leg,
    LegProgress,
    MissionBuilder,
    MissionClient,
    MissionMap,
    ModeController,
    OnResult,
    SensorHealth,
    Telemetry,
    choose_landing_approach,
    describe_autopilot,
    gps_input_fields,
    is_usable_fix,
    message_rates,
    path_height_above_home,
    steered_vehicle,
    usbl_fix,
)
from mavlink.translate import ENTITIES
from runtime import ParameterError, State, consume, expect, periodic
from runtime.devices import Device
from runtime.vehicle import general_number
from tasks.control.autopilot.autopilot_connection_url import open_device, parse_address
from tasks.control.autopilot.autopilot_parameters import AutopilotTask

Loops = imc.CLoopsMask
Status = imc.ArmingState.State
REPEAT = 5.0  # s after which messages that do not come are asked for again
TICK = 5.0  # Hz; how often targets are sent
FORGOTTEN = 10.0  # s after which a health that is not repeated is unknown
USBL = "USBL"
PATH_CONTROL = "Path Control"  # the entity that shows whether a path can be followed


class MAVLink(AutopilotTask):
    """Connects an autopilot that steers the vehicle: its measurements become messages, and it follows DesiredPath.

    While the loop PATH is enabled, each path becomes targets for ArduPilot's GUIDED mode or PX4's OFFBOARD, or a
    DO_REPOSITION for PX4 and planes, or an item of a mission in the autopilot's memory; it also takes off and lands. A
    mode that a pilot or a failsafe of the autopilot chooses is not fought: the plan ends. When no maneuver leads it, it
    holds; after an Abort, or for an aircraft after `Idle Timeout`, it does the `Ending`.
    """

    def configure(self) -> None:
        super().configure()
        try:
            self._where = parse_address(self.address)
            self._key = read_key(Path(self._where.key).expanduser()) if self._where.key else b""
        except (ValueError, OSError, RuntimeError) as error:
            raise ParameterError("Address", str(error)) from None
        self._parts = {label: self.reserve_entity(label) for label in (PATH_CONTROL, *ENTITIES[1:])}
        self._highest = general_number(self.vehicle.profile, "Absolute Maximum Altitude", math.inf)

    def start(self) -> None:
        dialect = load_dialect()
        self._telemetry = Telemetry(dialect, self.geoid_undulation, self.position_timeout, self.age)
        self._sensors = SensorHealth(self._show)
        self._loops = EnabledLoops(Loops.PATH)
        self._limit = math.inf
        self._asked = -math.inf
        self._critical = False
        self._heartbeat = HeartbeatWatch()
        self._wind: imc.EstimatedStreamVelocity | None = None
        self._progress = LegProgress()
        self.device: Device = open_device(self, self._where, self.receive)
        self.connection: AutopilotConnection = AutopilotConnection(
            dialect,
            self.device,
            self.log.warning,
            self.autopilot_id,
            own=mavlink_system_id(self.system),
            datagrams=self._where.scheme.startswith("udp"),
            signing=Signing(self._key, SigningTime(lambda: self.now)) if self._key else None,
        )
        missions = MissionClient(self.connection.send)
        self._mission_map = MissionMap(missions, uploads=self.uploads)
        self.controller: ModeController = ModeController(
            self._send_command,
            self.connection.send,
            self.log.warning,
            self._telemetry.recent_text,
            missions,
        )
        self.set_entity_state(State.BOOT, f"waiting for an autopilot at {self.address}")

    def receive(self, data: bytes) -> None:
        """Take bytes from the autopilot and other systems on the link."""
        for message in self.connection.receive(data, self.now_without_stalls):
            self._dispatch(message)

    def _dispatch(self, message: ReceivedMessage) -> None:
        name, values = message.name, message.values
        if name == "HEARTBEAT":
            self.on_heartbeat(values)
        elif name == "COMMAND_ACK":
            if self.connection.is_for_us(message):
                self.connection.commands.receive(values["command"], values["result"], self.now_without_stalls)
        elif name == "TIMESYNC":
            if values["tc1"] > 0 and self.connection.is_our_timesync(values["ts1"]):
                self._telemetry.clock.apply_timesync(values["ts1"] / 1e9, values["tc1"] / 1e9, self.now)
        elif name == "EXTENDED_SYS_STATE":
            self.controller.landed_state = values["landed_state"]
        elif name == "SYS_STATUS":
            self._sensors.receive(values)
        elif name == "POSITION_TARGET_GLOBAL_INT":
            lat, lon = (math.radians(values[f"{axis}_int"] / 1e7) for axis in ("lat", "lon"))
            self.controller.targets.receive_shown(lat, lon, self.now_without_stalls)
        elif name.startswith("MISSION_") and ("target_system" not in values or self.connection.is_for_us(message)):
            self.controller.missions.receive(name, values, self.now_without_stalls)
        self._translate(message)

    @expect(every="longest_silence")
    def on_heartbeat(self, values: Mapping[str, int]) -> None:
        """Take a HEARTBEAT: mode and arming."""
        controller, first = self.controller, self._heartbeat.at == -math.inf
        if first:
            offboard = self.px4_guidance == "offboard"
            vehicle = controller.vehicle = steered_vehicle(values["autopilot"], values["type"], offboard=offboard)
            controller.missions.first = 0 if values["autopilot"] == PX4 else 1
            self._telemetry.set_vehicle_type(values["type"], flies=vehicle is not None and vehicle.flies)
            self.log.info(f"the autopilot is {self.connection.system}: {vehicle.name if vehicle else 'unknown'}")
        before = controller.mode, controller.armed
        if self._heartbeat.is_late(self.now_without_stalls, self.latest_heartbeat):
            self.log.info(f"the autopilot was silent for {self.now_without_stalls - self._heartbeat.at:.1f} s")
        returns = self._heartbeat.receive(self.now_without_stalls)
        controller.mode, controller.armed = values["custom_mode"], bool(values["base_mode"] & ARMED)
        self._critical = values["system_status"] in CRITICAL
        if returns:
            controller.restore_goal_on_connection(controller.mode, controller.armed, self.now_without_stalls)
            self.connection.send_timesync(self.now_ns)
            self._request_messages()
        self.publish(imc.ArmingState(state=Status.ARMED if controller.armed else Status.DISARMED))
        if before != (controller.mode, controller.armed):
            self._control()

    def _translate(self, message: ReceivedMessage) -> None:
        restarts = self._telemetry.restarts
        for label, translated in self._telemetry.receive(message, self.now):
            entity = self.entity if label == ENTITIES[0] else self._parts.get(label)
            if entity is None:
                continue
            self.publish(translated, keep_time=True, entity=entity)
            if isinstance(translated, imc.EstimatedState):
                self._sensors.report_navigation_state()
                self._steer()
            elif isinstance(translated, imc.EstimatedStreamVelocity):
                self._wind = translated
        if self._telemetry.restarts > restarts:
            self.log.warning("the autopilot has started anew")
            self._mission_map.reset()
            self._request_messages()
        if doubt := self._telemetry.geoid_warning():
            self.log.warning(doubt)

    def _steer(self) -> None:
        """See how far the vehicle has come."""
        controller, at = self.controller, self._telemetry.position
        controller.position = at
        leg = controller.leg
        if leg is None or at is None:
            return
        reach = ArrivalTolerance(self.near_radius, self.height_tolerance)
        done = leg.item is not None and controller.missions.is_past(leg.item)
        arrived, report = self._progress.update(
            leg, at, reach, self.now_without_stalls, done=done, waits=controller.is_progress_paused
        )
        if self._progress.error:
            controller.fail(self._progress.error)
        if arrived:
            self._control()
        if report is not None:
            self.publish(report)

    @consume
    def on_control_loops(self, loops: imc.ControlLoops) -> None:
        if self._loops.receive(loops) and not self._loops.mask:
            self.controller.hold_position(self.now_without_stalls)

    @consume
    def set_altitude_limit(self, limits: imc.OperationalLimits) -> None:
        highest = limits.max_altitude if limits.mask & imc.OpLimitsMask.MAX_ALT else math.inf
        self._limit = highest if highest >= 0.0 else self._limit

    @consume
    def follow_path(self, path: imc.DesiredPath) -> None:
        """Follow a path."""
        controller = self.controller
        if not self._loops.mask:
            return
        if controller.vehicle is None or controller.position is None:
            controller.fail("the autopilot is unknown, or its position is")
            return
        vehicle, at = controller.vehicle, controller.position
        try:
            height = path_height_above_home(path, at, self.geoid_undulation, flies=vehicle.flies, dives=vehicle.dives)
            leg = Leg(path, at, min(height, self._highest, self._limit))
            self._mission_map.assign_leg_item(leg, self._writer, self.now_without_stalls, roams=vehicle.roams)
            controller.follow(leg, self.now_without_stalls)
        except ValueError as error:
            controller.fail(str(error))
            return
        self._progress.restart(self.now_without_stalls)
        self.publish(imc.DesiredSpeed(value=path.speed, speed_units=path.speed_units))
        self.publish(imc.DesiredZ(value=path.end_z, z_units=path.end_z_units))

    @consume
    def upload_plan(self, plan: imc.PlanSpecification) -> None:
        """Put the plan that begins into the autopilot's memory."""
        self._mission_map.upload_plan(plan, self._writer, self.now_without_stalls)

    def _writer(self) -> MissionBuilder:
        """Makes missions. Raises ValueError without a position."""
        controller = self.controller
        if controller.vehicle is None or controller.position is None:
            raise ValueError("the autopilot is unknown, or its position is")
        course = math.radians(self.landing_course) if self.landing_course >= 0.0 else None
        final = choose_landing_approach(
            self.approach_length, self.approach_height, course, self._wind, controller.position
        )
        return MissionBuilder(controller.vehicle, controller.position, self.geoid_undulation, final)

    @consume
    def aid_with_gps_fix(self, fix: imc.GpsFix) -> None:
        """Give the autopilot the position of another sensor."""
        if self.aiding_entity and self.vehicle.entities.label(self.system, fix.src_ent) == self.aiding_entity:
            self._aid(fix)

    @consume(others=True)
    def aid_with_usbl_fix(self, fix: imc.UsblFixExtended) -> None:
        """Send it the position of this vehicle by a ship's USBL."""
        if self.aiding_entity == USBL and fix.target == self.system_name:
            self._aid(usbl_fix(fix, self.geoid_undulation))

    def _aid(self, fix: imc.GpsFix) -> None:
        if self._heartbeat.is_alive and is_usable_fix(fix):
            self.connection.send("GPS_INPUT", gps_input_fields(fix, self.geoid_undulation, self.now))

    @consume(others=True)
    def abort(self, abort: imc.Abort) -> None:
        """End the flight; an end by the vehicle itself does not interrupt a pilot in control."""
        if self.is_addressed_or_broadcast(abort) and not (
            abort.src == self.system and self.controller.goal is GuidedGoal.NONE
        ):
            self._loops.mask = 0
            self.controller.end_flight(self.ending, self.now_without_stalls)
            self._control()

    @periodic(TICK)
    def check_timeouts(self) -> None:
        """Do what is due, and judge how the autopilot is."""
        controller, vehicle = self.controller, self.controller.vehicle
        if self._heartbeat.becomes_late(self.now_without_stalls, self.latest_heartbeat) and controller.is_following_leg:
            self.log.warning(f"the autopilot is silent: the plan waits for it, up to {self.longest_silence:g} s")
        if self._heartbeat.becomes_lost(self.now_without_stalls, self.longest_silence):
            self._on_silence()
        if self._is_late:
            return
        self.connection.commands.tick(self.now_without_stalls)
        controller.missions.tick(self.now_without_stalls)
        idles = controller.goal is GuidedGoal.HOLD and vehicle is not None and vehicle.flies and controller.armed
        if idles and 0.0 < self.idle_timeout < self.now_without_stalls - controller.since:
            self.log.warning(f"no maneuver for {self.idle_timeout:g} s: {self.ending}")
            controller.end_flight(self.ending, self.now_without_stalls)
        self._control()

    @periodic(1.0)
    def maintain_connection(self) -> None:
        """Send HEARTBEAT, compare the clocks, and ask again for what does not come."""
        self.connection.send_heartbeat()
        if self._is_late:
            self.controller.position = None  # where it was is no place to steer from
        if not self._heartbeat.is_alive or self._is_late:
            return
        self.connection.send_timesync(self.now_ns)
        if self._telemetry.is_message_overdue("SYS_STATUS", FORGOTTEN):
            self._sensors.expire()
        missing = self._telemetry.missing_messages()
        late = self.now_without_stalls - self._asked > REPEAT
        if missing and late:
            self._request_messages()
        if missing:
            self.controller.position = None  # where it was is no place to steer from
        resumes = self._heartbeat.resumes(self.now_without_stalls, self.position_timeout)
        if missing and not resumes and (late or self._parts[NAVIGATION].state is State.NORMAL):
            self._sensors.report_missing_messages(missing, self._telemetry.patience)

    def _control(self) -> None:
        """Let the controller do what is next, and show how it is going."""
        if self._heartbeat.is_alive:
            self.controller.tick(self.now_without_stalls)
            error = self.controller.error
            self._show(PATH_CONTROL, State.ERROR if error else State.NORMAL, error or self.controller.goal.name.lower())
            if self.device.is_open:
                self.set_entity_state(*self._described())

    @property
    def _is_late(self) -> bool:
        """Whether the whole link is silent: then nothing is wrong with the position alone."""
        return self._heartbeat.is_late(self.now_without_stalls, self.latest_heartbeat)

    def _described(self) -> tuple[State, str]:
        controller, counts = self.controller, {**self.connection.counts, "unsound": self._telemetry.invalid}
        name = controller.vehicle.name if controller.vehicle is not None else "unknown, cannot be steered"
        return describe_autopilot(name, armed=controller.armed, critical=self._critical, counts=counts)

    def _on_silence(self) -> None:
        """The autopilot has fallen silent."""
        self.controller.drop_leg_on_silence(self.now_without_stalls)
        self.connection.commands.cancel()
        self._mission_map.reset()
        words = f"no HEARTBEAT of the autopilot for {self.longest_silence:g} s"
        self.log.error(words)
        self.set_entity_state(State.ERROR, words)
        for label, entity in self._parts.items():
            if entity.stateful:
                self._show(label, State.ERROR, "the autopilot is silent")

    def _request_messages(self) -> None:
        """Ask the autopilot for its messages."""
        self._asked = self.now_without_stalls
        connection = self.connection
        rates = message_rates(
            connection.autopilot, connection.type, self.attitude_rate, self.position_rate, self.sensor_rate
        )
        self.connection.request_messages(rates, self.now_without_stalls)

    def _show(self, label: str, state: State, words: str) -> None:
        self.set_entity_state(state, words, entity=self._parts[label])

    def _send_command(self, message: str, fields: Fields, then: OnResult) -> None:
        self.connection.commands.send(message, fields, then, self.now_without_stalls, urgent=True)

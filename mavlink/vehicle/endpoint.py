"""A vehicle as MAVLink ground stations meet it: the sessions with them, and the services that answer."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import imc
from mavlink import Dialect, Mode, ReceivedMessage, split, statustext
from mavlink.missions import first_item_seq
from mavlink.translate import cameras_from_imc
from mavlink.vehicle.camera import (
    CameraBroadcast,
    CameraComponent,
    CameraService,
    CameraTelemetry,
    ImageTransmission,
    addressed_sessions,
)
from mavlink.vehicle.clock_service import ClockService
from mavlink.vehicle.command import (
    COMMANDS,
    CommandService,
    CommandTargets,
    GcsFailsafe,
    OffboardTarget,
    RelayNames,
    Relays,
    SetpointService,
    VehicleControl,
    is_guided_item,
    is_order,
    make_banner_handler,
    message_requests,
    refuse_if_read_only,
)
from mavlink.vehicle.files import FileAndLogTransfer, VirtualFiles
from mavlink.vehicle.id_conflicts import IdConflicts
from mavlink.vehicle.interfaces import CameraView, FileStore, ParameterView, PictureStore, VehiclePort
from mavlink.vehicle.mission import MissionStore, MissionTransfer, PlanClient
from mavlink.vehicle.model import AUTOPILOT, VehicleModel
from mavlink.vehicle.parameters import ComponentMetadata, ParameterServer, ParameterTable
from mavlink.vehicle.service import Handler
from mavlink.vehicle.session import HEARTBEAT_PERIOD, LinkTraits, Session
from mavlink.vehicle.stations_in_reach import StationsInReach
from mavlink.vehicle.telemetry import AutopilotTelemetry, NamedValue, StreamService, TelemetryContext

TICK_PERIOD = 1.0  # s
UNLISTED = "unlisted"
NO_RELAYS = RelayNames()
CHANGES = (imc.VehicleState, imc.PlanControlState, imc.ArmingState, imc.AutopilotMode)
"""Messages that can change the mode or arming."""


@dataclass(frozen=True, slots=True)
class VehicleEquipment:
    """Equipment of a vehicle for ground stations, besides its state; of `cameras` the first six count."""

    parameters: Sequence[ParameterView]
    files: FileStore
    pictures: PictureStore
    cameras: Sequence[CameraView] = ()
    named_values: Sequence[NamedValue] = ()
    relays: RelayNames = NO_RELAYS


class VehicleEndpoint:
    """The vehicle's side of all services, without sockets, files and clocks.

    The owner of the links calls `connect` for each peer, `receive` with its frames, `update` with the messages
    of the vehicle, and `poll` at `next_deadline` and after each of the others. Frames leave through the `transmit` of
    their session. Times `now` never go back; they are in s since 1970. `warn` gets problems of the
    setup. `refusal` is why no order is taken, empty if they are.
    """

    def __init__(
        self,
        dialect: Dialect,
        model: VehicleModel,
        port: VehiclePort,
        equipment: VehicleEquipment,
        *,
        warn: Callable[[str], object],
        plans: PlanClient | None = None,
        refusal: str = "",
    ):
        self.dialect = dialect
        self.model = model
        self.sessions: list[Session] = []
        self._now = 0.0
        self._poll_due, self._tick_due = -math.inf, -math.inf
        self._warn = warn
        self._refusal = refusal
        self.plans: PlanClient = plans or PlanClient(port)
        self.mission: MissionStore = MissionStore(model, port, self.plans, self._report_reached)
        self.control: VehicleControl = VehicleControl(model, port, self.plans, self.mission, self._send_statustext_now)
        self.failsafe: GcsFailsafe = GcsFailsafe(self.control)
        self.stations: StationsInReach = StationsInReach(port.age)
        self.parameters: ParameterTable = ParameterTable(equipment.parameters)
        self.cameras: list[CameraComponent] = [
            CameraComponent(component, view, model, port, equipment.pictures)
            for component, view in zip(cameras_from_imc.COMPONENTS, equipment.cameras, strict=False)
        ]
        model.camera = next((camera.label for camera in self.cameras if camera.takes_pictures), "")
        self.id_conflicts: IdConflicts = IdConflicts(
            model.system, frozenset((AUTOPILOT, *(camera.component for camera in self.cameras))), warn
        )
        metadata = ComponentMetadata(model.identity.name, self.parameters)
        self.telemetry: AutopilotTelemetry = AutopilotTelemetry(
            dialect, TelemetryContext(model, self.mission, metadata, equipment.named_values)
        )
        self._camera_telemetry = [CameraTelemetry(dialect, camera) for camera in self.cameras]
        described = {camera.definition_file_name: partial(getattr, camera, "definition") for camera in self.cameras}
        self._files = FileAndLogTransfer(VirtualFiles({**metadata.files, **described}, equipment.files))
        self._images = ImageTransmission(self.cameras)
        self._broadcast = CameraBroadcast(model, self.cameras, self._all_sessions, self._send_statustext_now)
        targets = CommandTargets(
            self.control, OffboardTarget(self.control), Relays(self.control.publish, equipment.relays)
        )
        commands = {number: partial(command, targets) for number, command in COMMANDS.items()}
        self.commands: CommandService = CommandService(
            model,
            {**message_requests.COMMANDS, message_requests.SEND_BANNER: make_banner_handler(model.kind), **commands},
            COMMANDS.keys(),
            refusal,
        )
        self.mission_transfer: MissionTransfer = MissionTransfer(self.mission)
        self._control_service = SetpointService(targets)
        self._parameter_server = ParameterServer(self.parameters, port, self._all_sessions)
        self._services = (
            self.commands,
            self._parameter_server,
            self.mission_transfer,
            self._files,
            self._control_service,
            StreamService(),
            ClockService(),
        )
        self._camera_services = [CameraService(camera, self._files, COMMANDS.keys()) for camera in self.cameras]
        self._handlers: Mapping[int, Mapping[str, Handler]] = {
            AUTOPILOT: {name: each for service in self._services for name, each in service.handlers.items()},
            **{
                camera.component: service.handlers
                for camera, service in zip(self.cameras, self._camera_services, strict=True)
            },
        }
        self._last_shown = self.urgent_state

    def connect(self, traits: LinkTraits, transmit: Callable[[bytes], object], now: float) -> Session:
        """A session with a new peer; on slow links without those of the cameras."""
        views = [] if traits.low else self._camera_telemetry
        parts = [Session(camera, traits, transmit, now) for camera in views]
        session = Session(self.telemetry, traits, transmit, now, parts)
        self.sessions.append(session)
        self._poll_due = now
        return session

    def end_contact(self, session: Session) -> None:
        """End the contact with a peer that is silent; its session stays."""
        session.end_contact()
        for service in self._services:
            service.forget(session)
        for part in session.cameras:
            for service in (self._files, *self._camera_services):
                service.forget(part)

    def disconnect(self, session: Session) -> None:
        """End a session."""
        self.end_contact(session)
        if session in self.sessions:
            self.sessions.remove(session)

    def receive(
        self, session: Session, data: bytes | ReceivedMessage, now: float, refusal: str = ""
    ) -> Mapping[str, int]:
        """Answer a datagram or a message; returns how many messages were ignored, by reason.

        With a `refusal` orders are answered with this reason, and count as UNLISTED.
        """
        for part in (session, *session.cameras):
            part.refusal = refusal
        if isinstance(data, ReceivedMessage):
            fault = self._receive(session, data, now)
            return {fault: 1} if fault else {}
        found, damages = split(data, self.dialect)
        ignored = {"malformed": damages + (not data)}
        for message in found:
            if fault := self._receive(session, message, now):
                ignored[fault] = ignored.get(fault, 0) + 1
        return {fault: count for fault, count in ignored.items() if count}

    def _receive(self, session: Session, message: ReceivedMessage, now: float) -> str:
        self._now = self._poll_due = now
        session.received.receive(message)
        parts = addressed_sessions(session, message)
        if not parts:
            return "foreign"
        if session.received.is_duplicate_order(message, now):
            return "doubled"
        if not session.refusal:
            self.failsafe.receive(message, now)
            self.stations.receive(message, now)
        session.note_contact(now)
        if message.name == "DATA_TRANSMISSION_HANDSHAKE":
            self._images.receive(session, message, now)
        if message.name == "SETUP_SIGNING":
            session.send_statustext(statustext.WARNING, "No keys over the air: give the link a key file", now)
        elif not (session.low and message.name == "REQUEST_DATA_STREAM"):  # stations ask for all at 4 Hz, unasked
            for part in parts:
                self.dispatch(part, message, now)
            self.send_changes(now)
        return UNLISTED if session.refusal and is_order(message) else ""

    def dispatch(self, session: Session, message: ReceivedMessage, now: float) -> None:
        """Let a component answer a message; most need no answer."""
        component = session.source.component
        handler = self._handlers[component].get(message.name)
        refusal = session.refusal or self._refusal
        if component == AUTOPILOT and refuse_if_read_only(session, message, refusal, now):
            return
        if component == AUTOPILOT and is_guided_item(message):
            self._control_service.execute_guided_item(session, message, now)
        elif handler is not None:
            handler(session, message, now)

    def receive_imc_message(self, message: imc.Message, label: str, now: float) -> None:
        """Take a message of the vehicle, sent by the entity with a label; what matters is shown immediately."""
        self._now = now
        match message:
            case imc.LogBookEntry():
                severity = statustext.SEVERITY.get(message.type, statustext.INFO)
                if severity != statustext.DEBUG:
                    self.send_statustext(severity, message.text, now)
            case imc.Event() | imc.EstimatedMugState():
                self._broadcast.update(message, label, now)
            case imc.EntityParameters():
                self._broadcast.update(message, label, now)
                self._parameter_server.send_changed_parameters(message)
            case imc.Abort():
                self.update_state(message, label, now)
                self.send_statustext(statustext.EMERGENCY, "Abort", now)
            case _:
                self.update_state(message, label, now)
                if isinstance(message, CHANGES):
                    self.send_changes(now)

    def update_state(self, message: imc.Message, label: str, now: float) -> None:
        """Take a message into the state of the vehicle and its mission, without showing it."""
        self.model.update(message, label, now)
        if isinstance(message, imc.PlanControlState):
            self.mission.update(message, now)

    def receive_reply(self, reply: imc.PlanControl | imc.PlanDB, now: float) -> None:
        """Take an answer of the vehicle to what a ground station has asked for."""
        self._now = now
        self.plans.receive(reply)
        self.send_changes(now)

    def check_timeouts(self, now: float) -> None:
        """Give up or repeat unanswered requests, once a second; called by `poll` if not called otherwise."""
        self._now, self._tick_due = now, now + TICK_PERIOD
        options = self.model.options
        self.model.forget_old()
        self.plans.tick(now)
        for service in self._services:
            service.check_timeouts(now)
        timeout = options.gcs_timeout
        if timeout and self.failsafe.tick(options.gcs_action, timeout * options.clock_speed, now):
            self._warn(f"no ground station for {timeout:g} s: {options.gcs_action}")
        self._broadcast.expire_parameter_changes(now)

    def poll(self, now: float) -> None:
        """Send what is due."""
        if now >= self._tick_due:
            self.check_timeouts(now)
        self._now = now
        self.mission_transfer.poll(now)
        self.model.forget_old()
        self._poll_due = min((session.poll(now) for session in self._all_sessions()), default=now + HEARTBEAT_PERIOD)
        self.commands.poll(now)
        self._parameter_server.poll(now)

    @property
    def next_deadline(self) -> float:
        """Time at which `poll` has something to do, in s since 1970."""
        deadlines = (service.next_deadline for service in self._services)
        return min([self._poll_due, self._tick_due, *(due for due in deadlines if due is not None)])

    @property
    def urgent_state(self) -> tuple[tuple[Mode, bool, bool], tuple[int, int, int]]:
        """State that stations must receive immediately: mode, arming, an Abort; state and progress of the mission."""
        return self.model.urgent_state, self.mission.progress

    def send_changes(self, now: float) -> None:
        """Send a change of mode or arming immediately: ground stations wait for it."""
        present = self.urgent_state
        if self._last_shown == present:
            return
        before, self._last_shown = self._last_shown, present
        for session in self._all_sessions():
            if before[0] != present[0]:
                session.build_and_send("HEARTBEAT", now)
                if session.period("CURRENT_MODE"):
                    session.build_and_send("CURRENT_MODE", now)
            if before[1] != present[1]:
                session.build_and_send("MISSION_CURRENT", now)

    def send_statustext(self, severity: int, words: str, now: float) -> None:
        """Send a text to all stations, also to those that connect later."""
        self._now = now
        self._send_statustext_now(severity, words)

    def close(self) -> None:
        """Close the files that stations read."""
        self._files.close()

    def _send_statustext_now(self, severity: int, words: str) -> None:
        self.model.notices.append((severity, words))
        for session in self._all_sessions():
            session.send_statustext(severity, words, self._now)

    def _report_reached(self, numbers: Sequence[int]) -> None:
        """Report to all stations which items of the mission are over."""
        for session in self._all_sessions():
            for number in numbers:
                session.send("MISSION_ITEM_REACHED", {"seq": number + first_item_seq(session.flavor)})

    def _all_sessions(self) -> list[Session]:
        """A new list, since sending may end a session."""
        return list(self.sessions)

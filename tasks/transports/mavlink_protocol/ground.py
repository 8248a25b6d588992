"""The links of a vehicle to ground stations: who is there, what they hear, and what they ask for."""

import math
from collections.abc import Callable, Sequence
from typing import get_args

import imc
from imc.discovery import Service
from mavlink import KINDS, SYSTEMS, ReceivedMessage, statustext
from mavlink.missions import first_item
from runtime import Task, consume, param, periodic
from runtime.bus import Subscription
from runtime.kernel import Timer
from runtime.task import ParameterError
from tasks.transports.imc_links.sockets import network_speed
from tasks.transports.mavlink_protocol.camera_services import hearers, serve_camera
from tasks.transports.mavlink_protocol.cameras import parse_video
from tasks.transports.mavlink_protocol.commands import look_after
from tasks.transports.mavlink_protocol.figures import Heard
from tasks.transports.mavlink_protocol.gallery import Gallery
from tasks.transports.mavlink_protocol.keys import Keys, usable_route
from tasks.transports.mavlink_protocol.links import Link, Peer, name_of
from tasks.transports.mavlink_protocol.named_values import parse_named_value
from tasks.transports.mavlink_protocol.network import Network
from tasks.transports.mavlink_protocol.parameters import ParameterEntry
from tasks.transports.mavlink_protocol.services import serve
from tasks.transports.mavlink_protocol.session import HEARTBEAT_PERIOD, SOON, Session
from tasks.transports.mavlink_protocol.streams import STREAMS
from tasks.transports.mavlink_protocol.switches import parse_button, parse_light
from tasks.transports.mavlink_protocol.system import COMPONENT, MavlinkSystem
from tasks.transports.mavlink_protocol.telemetry_log import TelemetryLogs
from tasks.transports.mavlink_protocol.thumbnails import Studio
from tasks.transports.mavlink_protocol.twins import Twins
from tasks.transports.mavlink_protocol.watch import ACTIONS, Watch

Offered = imc.AnnounceService.ServiceType
LINKS = ["udpout://127.0.0.1:14550", "udpout://127.0.0.1:14540?flavour=px4", "udpin://127.0.0.1:14551"]
SET_TIMEOUT = 0.25
CHANGES = (imc.VehicleState, imc.PlanControlState, imc.ArmingState, imc.AutopilotMode)


class GroundLinks(Task):
    """Telemetry, commands and parameters over all links, of a vehicle that `make_autopilot` gives."""

    external = True
    requires = "mavlink"
    hears_others = False  # whether other systems are shown

    links: list[str] = param(
        LINKS,
        "",
        "Links, SCHEME://ADDRESS[:PORT]?flavour=..&rates=..&key=..; udpin and tcpin wait for stations, udpout, "
        "udpbcast and tcpout call them, serial:///dev/ttyUSB0?baud=57600 is a line.",
        editable=False,
        usable=usable_route,
    )
    system_id: int = param(
        0, "1", "MAVLink system id; 0 derives it from the IMC id.", minimum=0, maximum=SYSTEMS, editable=False
    )
    vehicle_kind: str = param(
        "submarine", "", "MAV_TYPE reported to ground stations.", choices=tuple(KINDS), editable=False
    )
    geoid_undulation: float = param(
        0.0, "m", "Height of the geoid above the ellipsoid, for aircraft.", minimum=-120, maximum=100, editable=False
    )
    attitude_rate: float = param(10.0, "Hz", "Rate of ATTITUDE.", minimum=0, maximum=200)
    position_rate: float = param(4.0, "Hz", "Rate of positions and VFR_HUD.", minimum=0, maximum=200)
    status_rate: float = param(2.0, "Hz", "Rate of SYS_STATUS.", minimum=0, maximum=200)
    hold_speed: float = param(1.2, "m/s", "Speed back to the place where it was told to hold.", minimum=0.1, maximum=20)
    hold_radius: float = param(
        0.0,
        "m",
        "Radius of the circle on which an AUV under water holds; 0 for the smallest of the maneuver StationKeeping.",
        minimum=0,
        maximum=100,
    )
    takeoff_altitude: float = param(10.0, "m", "Altitude above home of a takeoff without one.", minimum=1, maximum=120)
    gcs_timeout: float = param(
        0.0,
        "s",
        "Silence of all ground stations after which a vehicle that does what one has asked for does `GCS Action`; "
        "0 for never.",
        name="GCS Timeout",
        minimum=0,
    )
    gcs_action: str = param(
        "Hold", "", "What a vehicle does that its ground stations have lost.", name="GCS Action", choices=tuple(ACTIONS)
    )
    named_values: list[str] = param(
        [],
        "",
        "Figures sent as NAMED_VALUE_FLOAT, [NAME=]MESSAGE[.FIELD][:ENTITY].",
        editable=False,
        usable=parse_named_value,
    )
    maximum_peers: int = param(
        8, "1", "Most ground stations on a link that waits for them.", minimum=1, maximum=64, editable=False
    )
    peer_timeout: float = param(
        30.0, "s", "Silence after which a ground station is forgotten.", minimum=1, editable=False
    )

    tlog: bool = param(False, "", "Record all frames in the folder of the log, as Data.tlog.", editable=False)
    cameras: bool = param(True, "", "Show each camera of the vehicle as a component of its own.", editable=False)
    video_streams: list[str] = param(
        [], "", "Videos of cameras: ENTITY LABEL=rtsp://ADDRESS.", editable=False, usable=parse_video
    )
    relays: list[str] = param([], "", "Power channels that stations switch as relays 0, 1, ...", editable=False)
    lights: list[str] = param(
        [], "", "Lights as servo outputs of 1100 to 1900 µs: SERVO=LED.", editable=False, usable=parse_light
    )
    buttons: list[str] = param(
        [], "", "What the buttons of a joystick do: NUMBER=ACTION.", editable=False, usable=parse_button
    )
    detection_markers: bool = param(False, "", "Show detected objects on maps, as ADSB_VEHICLE, for 60 s.")

    def configure(self) -> None:
        if not self.links:
            raise ParameterError("Links", "is empty: add a link, or disable the task")
        self.rates: dict[str, float] = {
            name: getattr(self, stream.rate) if isinstance(stream.rate, str) else stream.rate
            for name, stream in STREAMS.items()
        }

    def start(self) -> None:
        self.speed = network_speed(self)
        self.keys = Keys(self)
        self.network = Network(self.links, self)
        self.asked: dict[str, Timer] = {}
        self.pump_timer: Timer | None = None
        self.pumping = False
        self.autopilot = self.make_autopilot()
        for kind in {value.kind for value in self.autopilot.named_values} - set(get_args(Heard)):
            self.vehicle.bus.subscribe(Subscription(kind, self.note, self, others=self.hears_others))
        root, warn = self.vehicle.log_root / self.system_name, self.log.warning
        self.recorder = TelemetryLogs(self.autopilot.dialect, root, warn) if self.tlog else None
        if self.recorder is not None:
            self.recorder.enter(self.vehicle.log_folder)
        self.stations = Watch(self.autopilot)
        components = frozenset((COMPONENT, *(camera.component for camera in self.autopilot.cameras)))
        self.twins = Twins(self.autopilot.system, components, self.log.warning)
        self.gallery = Gallery(self.autopilot, self.sessions)
        self.studio = Studio(self.offload)
        told = Service("mavlink+info", "0.0.0.0", path=f"/system/{self.autopilot.system}")
        self.publish(imc.AnnounceService(service=str(told), service_type=Offered.LOCAL | Offered.EXTERNAL))
        self.shown = self.autopilot.shown
        self.values = {entry.id: entry.value for entry in self.autopilot.parameters}

    def make_autopilot(self) -> MavlinkSystem:
        """The vehicle that stations see."""
        raise NotImplementedError

    def stop(self) -> None:
        self.network.close()
        self.autopilot.transfers.close()
        self.keys.close()
        if self.recorder is not None:
            self.recorder.close()

    @periodic(1.0)
    def look_after_links(self) -> None:
        """Forget silent peers and old figures, retry links that could not be opened, and report the state."""
        if self.recorder is not None:
            self.recorder.flush()
        self.autopilot.forget_old(self.now)
        self.autopilot.helm.look_after(self.now)
        self.autopilot.transfers.forget_silent(self.now)
        self.autopilot.target.look_after(self.now)
        if self.gcs_timeout and self.stations.look_after(self.gcs_action, self.gcs_timeout * self.speed, self.now):
            self.log.warning(f"no ground station for {self.gcs_timeout:g} s: {self.gcs_action}")
        self.gallery.look_after(self.now)
        self.keys.look_after(self.now)
        self.network.look_after(self.now - self.peer_timeout * self.speed)
        self.set_entity_state(*self.network.state(self.twins.trouble(self.now)))
        self.pump()

    def meet(self, link: Link, transmit: Callable[[bytes], object]) -> Session:
        route = link.route
        flavour, line = route.flavour, route.speed
        if self.recorder is not None:
            transmit = self.recorder.sending(flavour, transmit, lambda: self.now)
        return Session(
            self.autopilot, flavour, transmit, self.now, self.speed, line=line, low=route.low, sign=link.signer
        )

    def most(self, option: str) -> float:
        """A limit in the section General of the profile; infinite if there is none, or the plan engine refuses it."""
        try:
            return float(self.vehicle.profile.value("General", option))
        except ValueError:
            return math.inf

    def sessions(self) -> list[Session]:
        return self.network.sessions()

    def take(self, link: Link, peer: Peer, message: ReceivedMessage) -> None:
        """Obey a message that is for this vehicle."""
        self.twins.hear(message, name_of(peer), self.now)
        session = link.session(peer)
        if session is None:
            link.refuse(peer)
            return
        session.receipts.note(message)
        if self.recorder is not None:
            self.recorder.hear(session.flavour, message, self.now)
        if not (parts := hearers(session, message)):
            link.counts["foreign"] += 1
        elif session.receipts.is_copy(message, self.now):
            link.counts["doubled"] += 1
        else:
            self.obey(session, message, parts)

    def obey(self, session: Session, message: ReceivedMessage, parts: Sequence[Session] = ()) -> None:
        """Let the autopilot, or the components of `parts`, answer a message."""
        self.stations.hear(message, self.now)
        session.hear(message, self.now)
        if message.name == "DATA_TRANSMISSION_HANDSHAKE":
            self.studio.hear(session, message, self.now)
        if message.name == "SETUP_SIGNING":
            session.say(statustext.WARNING, "No keys over the air: give the link a key file", self.now)
        elif not (session.low and message.name == "REQUEST_DATA_STREAM"):  # stations ask for all at 4 Hz, unasked
            for part in parts or (session,):
                (serve if part.camera is None else serve_camera)(part, message, self.now)
            self.show_changes()
        if not self.pumping:
            self.pumping = True
            self.after(0.0, self.pump)

    def pump(self) -> None:
        """Send what is due on all links, and schedule the next call."""
        self.pumping = False
        if self.pump_timer is not None:
            self.pump_timer.cancel()
        self.autopilot.transfer.look_after(self.now)
        due = min((session.pump(self.now) for session in self.sessions()), default=self.now + HEARTBEAT_PERIOD)
        due = min(due, self.autopilot.transfer.due or due)
        due = min((when for session in self.sessions() if (when := look_after(session, self.now))), default=due)
        self.pump_timer = self.after(max(due - self.now, SOON), self.pump)

    def show_changes(self) -> None:
        """Send a change of mode or arming immediately: ground stations wait for it."""
        if self.shown != self.autopilot.shown:
            before, self.shown = self.shown, self.autopilot.shown
            for session in self.sessions():
                if before[0] != self.shown[0]:
                    session.send_now("HEARTBEAT", self.now)
                    if session.period("CURRENT_MODE"):
                        session.send_now("CURRENT_MODE", self.now)
                if before[1] != self.shown[1]:
                    session.send_now("MISSION_CURRENT", self.now)

    @consume
    def note(self, message: Heard) -> None:
        """Take what the vehicle is and does; a change of mode or arming is shown immediately."""
        self.autopilot.hear(message, self.vehicle.entities.label(message.src, message.src_ent), self.now)
        if isinstance(message, CHANGES):
            self.show_changes()

    @consume(others=True)
    def note_abort(self, abort: imc.Abort) -> None:
        if self.addressed(abort):
            self.autopilot.hear(abort, "", self.now)
            self.say(statustext.EMERGENCY, "Abort")

    @consume
    def tell(self, entry: imc.LogBookEntry) -> None:
        severity = statustext.SEVERITY.get(entry.type, statustext.INFO)
        if severity != statustext.DEBUG:
            self.say(severity, entry.text)

    @consume
    def watch_cameras(self, message: imc.Event | imc.EstimatedMugState | imc.EntityParameters) -> None:
        """Tell ground stations of pictures, detections and settings."""
        self.gallery.hear(message, self.vehicle.entities.label(message.src, message.src_ent), self.now)

    @consume
    def show_changed(self, reply: imc.EntityParameters) -> None:
        """Send changed parameters to all ground stations, whoever set them."""
        for item in reply.params:
            entry = (
                self.autopilot.parameters.of(reply.name, item.name) if isinstance(item, imc.EntityParameter) else None
            )
            if entry is not None and (entry.id in self.asked or entry.value != self.values[entry.id]):
                self.show_parameter(entry)

    def ask_for(self, entry: ParameterEntry, value: str) -> None:
        """Ask the vehicle to set a parameter; without an answer, send the old value."""
        wish = imc.EntityParameter(name=entry.parameter.name, value=value)
        self.publish(imc.SetEntityParameters(name=entry.task.entity.label, params=(wish,), dst=self.system))
        if entry.id not in self.asked:
            self.asked[entry.id] = self.after(SET_TIMEOUT, self.show_parameter, entry)

    def show_parameter(self, entry: ParameterEntry) -> None:
        asked = self.asked.pop(entry.id, None)
        if asked is not None:
            asked.cancel()
        self.values[entry.id] = entry.value
        for session in self.sessions():
            session.send_parameter(entry)

    @consume
    def follow_log(self, log: imc.LoggingControl) -> None:
        """Record where the vehicle logs now."""
        if self.recorder is not None:
            self.recorder.follow(log)

    def reach(self, numbers: Sequence[int]) -> None:
        """Tell all stations which items of the mission are over."""
        for session in self.sessions():
            for number in numbers:
                session.send("MISSION_ITEM_REACHED", {"seq": number + first_item(session.flavour)})

    def say(self, severity: int, words: str) -> None:
        self.autopilot.remember(severity, words)
        for session in self.sessions():
            session.say(severity, words, self.now)

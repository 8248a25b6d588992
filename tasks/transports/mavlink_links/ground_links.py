"""The links of a vehicle to ground stations: their peers, telemetry and requests."""

import math
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import get_args

import imc
from imc.console_acl import ConsoleAcl
from imc.discovery import Service
from mavlink import KINDS, SYSTEMS, ReceivedMessage, parse_link_url
from mavlink.vehicle import SOON, UNLISTED, LinkTraits, Session, ShownMessages, VehicleEndpoint
from mavlink.vehicle.camera import parse_video
from mavlink.vehicle.command import ACTIONS, parse_button, parse_light
from mavlink.vehicle.telemetry import STREAMS, NamedValue, parse_named_value
from runtime import ConfigWarning, Task, consume, param, periodic
from runtime.bus import Subscription
from runtime.kernel import Timer
from runtime.profile import listed_consoles
from runtime.task import ParameterError
from tasks.transports.imc_links.sockets import network_time_scale
from tasks.transports.mavlink_links.base_link import Link, Peer, peer_name
from tasks.transports.mavlink_links.link_set import LinkSet
from tasks.transports.mavlink_links.signing_keys import SigningKeys, parse_checked_link_url
from tasks.transports.mavlink_links.telemetry_log import TelemetryLogs

Offered = imc.AnnounceService.ServiceType
LINKS = ["udpout://127.0.0.1:14550", "udpout://127.0.0.1:14540?flavor=px4", "udpin://127.0.0.1:14551"]


class GroundLinksTask(Task):
    """Telemetry, commands and parameters over all links, of a vehicle that `make_endpoint` gives."""

    external = True
    requires = "mavlink"
    optional = True
    receives_others = False  # whether other systems are shown
    recorder: TelemetryLogs | None = None

    links: list[str] = param(
        LINKS,
        "",
        "Links, SCHEME://ADDRESS[:PORT]?flavor=..&rates=..&key=..; udpin and tcpin wait for stations, udpout, "
        "udpbcast and tcpout call them, serial:///dev/ttyUSB0?baud=57600 is a line.",
        editable=False,
        usable=parse_checked_link_url,
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
    hold_speed: float = param(1.2, "m/s", "Speed back to the position that it holds.", minimum=0.1, maximum=20)
    guided_speed: float = param(
        0.0, "m/s", "Speed of what stations order without one; 0 for `Hold Speed`.", minimum=0, maximum=20
    )
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
        "Hold", "", "Action of a vehicle that has lost its ground stations.", name="GCS Action", choices=tuple(ACTIONS)
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

    tlog: bool = param(
        False,
        "",
        "Record all frames as Data.tlog, in the folder of the log with which a flight begins.",
        editable=False,
    )
    cameras: bool = param(True, "", "Show each camera of the vehicle as a component of its own.", editable=False)
    video_streams: list[str] = param(
        [], "", "Videos of cameras: ENTITY LABEL=rtsp://ADDRESS.", editable=False, usable=parse_video
    )
    relays: list[str] = param([], "", "Power channels that stations switch as relays 0, 1, ...", editable=False)
    lights: list[str] = param(
        [], "", "Lights as servo outputs of 1100 to 1900 µs: SERVO=LED.", editable=False, usable=parse_light
    )
    buttons: list[str] = param(
        [], "", "Actions of the buttons of a joystick: NUMBER=ACTION.", editable=False, usable=parse_button
    )
    detection_markers: bool = param(False, "", "Show detected objects on maps, as ADSB_VEHICLE, for 60 s.")

    def configure(self) -> None:
        self.commanders: ConsoleAcl = listed_consoles(self)
        if not self.links:
            raise ParameterError("Links", "is empty: add a link, or disable the task")
        for option, texts, parse in (
            ("Named Values", self.named_values, parse_named_value),
            ("Video Streams", self.video_streams, parse_video),
            ("Lights", self.lights, parse_light),
            ("Buttons", self.buttons, parse_button),
        ):
            for text in texts:
                try:
                    parse(text)
                except ValueError as error:
                    raise ParameterError(option, str(error)) from None
        self.rates: dict[str, float] = {
            name: getattr(self, stream.rate) if isinstance(stream.rate, str) else stream.rate
            for name, stream in STREAMS.items()
        }

    def configuration_warnings(self) -> Iterator[ConfigWarning]:
        for text in self.links:
            try:
                link = parse_link_url(text)
            except ValueError:
                continue  # reported with its line as a value that cannot be used
            if link.deprecation:
                yield ConfigWarning("Links", f"{link.text}: {link.deprecation}")

    def start(self) -> None:
        self._resources = ExitStack()
        self.clock_speed: float = network_time_scale(self)
        self.keys: SigningKeys = SigningKeys(self)
        self._resources.callback(self.keys.close)
        self.poll_timer: Timer | None = None
        self.polls_soon = False
        self.endpoint: VehicleEndpoint = self.make_endpoint()
        self._resources.callback(self.endpoint.close)
        for kind in {value.kind for value in self.parse_named_values()} - set(get_args(ShownMessages)):
            self.vehicle.bus.subscribe(Subscription(kind, self.show_state, self, others=self.receives_others))
        if self.tlog:
            root = self.vehicle.log_root / self.system_name
            self.recorder = TelemetryLogs(self.endpoint.dialect, root, self.log.warning, self.is_in_flight)
            self._resources.callback(self.recorder.close)
            self.recorder.set_folder(self.vehicle.log_folder)
        self.link_set: LinkSet = LinkSet(self.links, self)
        self._resources.callback(self.link_set.close)
        service = Service("mavlink+info", "0.0.0.0", path=f"/system/{self.endpoint.model.system}")
        self.publish(imc.AnnounceService(service=str(service), service_type=Offered.LOCAL | Offered.EXTERNAL))

    def is_in_flight(self) -> bool:
        """Whether the vehicle is armed, or moves."""
        return self.endpoint.model.armed_or_moving

    def parse_named_values(self) -> list[NamedValue]:
        return [parse_named_value(text) for text in self.named_values]

    def make_endpoint(self) -> VehicleEndpoint:
        """The vehicle that stations see."""
        raise NotImplementedError

    def stop(self) -> None:
        self._resources.close()

    @periodic(1.0)
    def maintain_links(self) -> None:
        """Forget silent peers and old figures, retry links that could not be opened, and report the state."""
        if self.recorder is not None:
            self.recorder.flush()
        self.endpoint.check_timeouts(self.now)
        self.keys.tick(self.now)
        self.link_set.maintain_links(self.peer_timeout * self.clock_speed)
        self.set_entity_state(*self.link_set.state(self.endpoint.id_conflicts.trouble(self.now)))
        self.send_due_messages()

    def connect_peer(
        self, link: Link, transmit: Callable[[bytes], object], takes_more: Callable[[], bool] = lambda: True
    ) -> Session:
        url = link.url
        if self.recorder is not None:
            transmit = self.recorder.recording_transmit(url.flavor, transmit, lambda: self.now)
        speed, line = self.clock_speed, url.bytes_per_second
        traits = LinkTraits(url.flavor, speed, line, low=url.low, sign=link.signer, takes_more=takes_more)
        return self.endpoint.connect(traits, transmit, self.now)

    @property
    def imc_id(self) -> int:
        return self.system

    def set_parameter(self, entity: str, name: str, text: str) -> None:
        """Ask the vehicle to set a parameter."""
        wish = imc.EntityParameter(name=name, value=text)
        self.publish(imc.SetEntityParameters(name=entity, params=(wish,), dst=self.system))

    def profile_limit(self, option: str) -> float:
        """A limit in the section General of the profile; infinite if there is none, or the plan engine rejects it."""
        try:
            return float(self.vehicle.profile.value("General", option))
        except ValueError:
            return math.inf

    def receive(self, link: Link, peer: Peer, message: ReceivedMessage) -> None:
        """Let the vehicle answer a message of a peer."""
        self.endpoint.id_conflicts.receive(message, peer_name(peer), self.now)
        session = link.open_session(peer)
        if session is None:
            link.reject(peer)
            return
        if self.recorder is not None:
            self.recorder.record_received(session.flavor, message, self.now)
        ignored = self.endpoint.receive(session, message, self.now, self.unlisted_reason(message, peer))
        link.counts.update(ignored)
        if UNLISTED in ignored:
            who = f"mavlink:{message.system}@{peer[0]}"
            link.warn_once(who, f"rejects orders of {who}: not in [General] Consoles")
        if not ignored and not self.polls_soon:
            self.polls_soon = True
            self.after(0.0, self.send_due_messages)

    def unlisted_reason(self, message: ReceivedMessage, peer: Peer) -> str:
        """Reason why orders of the system that has sent a message are not obeyed, "" if they are."""
        if self.commanders.allows_station(message.system, str(peer[0])):
            return ""
        return f"mavlink:{message.system} is not in [General] Consoles of {self.system_name}"

    def send_due_messages(self) -> None:
        """Send what is due on all links, and schedule the next call."""
        self.polls_soon: bool = False
        if self.poll_timer is not None:
            self.poll_timer.cancel()
        self.endpoint.poll(self.now)
        self.poll_timer = self.after(max(self.endpoint.next_deadline - self.now, SOON), self.send_due_messages)

    @consume
    def show_state(self, message: ShownMessages) -> None:
        """Take what the vehicle is and does; a change of mode or arming is shown immediately."""
        self.forward_to_endpoint(message)

    @consume(others=True)
    def show_abort(self, abort: imc.Abort) -> None:
        if self.is_addressed_or_broadcast(abort):
            self.endpoint.receive_imc_message(abort, "", self.now)

    @consume
    def show_event(self, message: imc.LogBookEntry | imc.Event | imc.EstimatedMugState | imc.EntityParameters) -> None:
        """Send ground stations texts, pictures, detections and settings."""
        self.forward_to_endpoint(message)

    def forward_to_endpoint(self, message: imc.Message) -> None:
        self.endpoint.receive_imc_message(message, self.vehicle.entities.label(message.src, message.src_ent), self.now)

    @consume
    def on_logging_control(self, log: imc.LoggingControl) -> None:
        """Record where the vehicle logs now."""
        if self.recorder is not None:
            self.recorder.on_logging_control(log)

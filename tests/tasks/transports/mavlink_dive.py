"""An AUV with both cameras, and ground stations without sockets that talk to them."""

import imc
from mavlink import encode, load_dialect, split
from runtime.kernel import parse_clock
from runtime.profile import load_profile
from runtime.vehicle import build
from tasks.transports.mavlink import MAVLink
from tasks.transports.mavlink_links.base_link import Link
from tests.outside import free_port
from tests.tasks.transports.mavlink_station import deliver

DIALECT = load_dialect()
PROFILE = "lauv-noptilus-1"
FISHEYE, MUG = 100, 101
ACCEPTED, REJECTED, DENIED, UNSUPPORTED = range(4)
REQUEST_MESSAGE, START, STOP = 512, 2000, 2001
TEXT, REAL32, INT32 = 11, 9, 6
PATIENCE = 60.0


class Dive:
    """An AUV with both cameras, and a ground station without a socket."""

    def __init__(self, folder, **parameters):
        quiet = [f"Vision.FisheyeCamera:{option}" for option in ("Save Images=false", "Size=64", "Face Size=32")]
        loaded = load_profile(PROFILE, overrides=quiet)
        made = build(
            loaded,
            loaded.parse_modes(["Kinematic", "Camera"]),
            clock=parse_clock("virtual", loaded.start_time_ns),
            log_root=folder / "log",
            state_folder=folder / "db",
        )
        self.vehicle = made.vehicle
        links = [f"udpin:127.0.0.1:{free_port()}:px4"]
        self.task = self.vehicle.add(MAVLink, "Transports.MAVLink", links=links, **{"peer_timeout": 1e6, **parameters})
        self.truths, self.mugs = [], []
        self.vehicle.observe(imc.SimulatedState, self.truths.append)
        self.vehicle.observe(imc.EstimatedMugState, self.mugs.append)
        self.vehicle.start()
        self.run(2.0)
        self.sessions = [self._meet(number) for number in range(2)]

    def _meet(self, number):
        frames = []
        link: Link = self.task.link_set.links[0]
        session = link.sessions["station", number] = self.task.connect_peer(link, frames.append)
        session.frames = frames
        return session

    def run(self, seconds):
        self.vehicle.run(seconds)

    def said(self, station=0):
        """What a station got since the last call."""
        frames = self.sessions[station].frames
        found = [message for frame in frames for message in split(frame, DIALECT)[0]]
        frames.clear()
        return found

    def ask(self, name, component=FISHEYE, *, station=0, seconds=0.4, **fields):
        """The answers of cameras and autopilot to a message, without what is streamed."""
        definition = DIALECT.by_name[name]
        fields = {"target_system": self.task.endpoint.model.system, "target_component": component, **fields}
        (message,), _ = split(encode(definition, definition.pack(fields), 0, 255, 190), DIALECT)
        self.said(station)
        deliver(self.task, self.sessions[station], message)
        if seconds:
            self.run(seconds)
        streams = {name for name, rate in self.task.rates.items() if rate} | {"CAMERA_TRACKING_GEO_STATUS"}
        streams |= {"ADSB_VEHICLE"}
        return [m for m in self.said(station) if m.name not in streams and (m.name, m.component) != ("STATUSTEXT", 1)]

    def order(self, command, *params, component=FISHEYE, **more):
        """The result of an order and what else came."""
        named = {f"param{number}": value for number, value in enumerate(params, 1)}
        found = self.ask("COMMAND_LONG", component, command=command, **named, **more)
        (ack,) = [m for m in found if m.name == "COMMAND_ACK"]
        assert (ack.values["command"], ack.values["target_system"]) == (command, 255)
        return ack.values["result"], [m for m in found if m is not ack]

    def texts(self, station=0):
        return [m.values["text"].decode() for m in self.said(station) if m.name == "STATUSTEXT"]


def named(messages, name):
    return [m for m in messages if m.name == name]

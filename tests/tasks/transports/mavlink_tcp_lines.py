"""A shipped vehicle in virtual time, and ground stations of PX4's flavor that are connected to it over TCP."""

import socket
from contextlib import suppress
from itertools import count

import imc
from mavlink import StreamSplitter, encode, mavlink_system_id
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from tasks.transports.mavlink import MAVLink
from tests.outside import free_port
from tests.tasks.transports.mavlink_station import DIALECT, HOST


class Line:
    """A station's end of a connection; its system keeps `room` bytes for it, 0 for the usual number."""

    def __init__(self, port, system, system_id, room):
        self.socket = socket.socket()
        if room:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, room)
        self.socket.connect((HOST, port))
        self.socket.setblocking(False)
        self.system = system
        self.target = {"target_system": system_id, "target_component": 1}
        self.sequence, self.splitter = count(), StreamSplitter(DIALECT)

    def send(self, name, **fields):
        definition = DIALECT.by_name[name]
        known = {field.name for field in definition.fields}
        target = {key: value for key, value in self.target.items() if key in known}
        payload = definition.pack({**target, **fields})
        self.socket.sendall(encode(definition, payload, next(self.sequence) % 256, self.system, 190))

    def read(self):
        """The messages that have come."""
        found = []
        with suppress(BlockingIOError):
            while data := self.socket.recv(1 << 16):
                found += self.splitter.feed(data)[0]
        return found


class ConnectedVehicle:
    """A vehicle of a shipped profile that has run for 20 s; its log book and its replies about plans from then on."""

    def __init__(self, profile, folder, **options):
        loaded, self.port = load_profile(profile), free_port()
        self.vehicle = build(
            loaded,
            loaded.parse_modes("Simulation"),
            clock=VirtualClock(loaded.start_time_ns),
            log_root=folder / "log",
            state_folder=folder / "db",
        ).vehicle
        kind = {"hexa-00": "hexacopter", "otter": "boat"}.get(profile, "submarine")
        links = [f"tcpin://{HOST}:{self.port}?flavor=px4"]
        self.vehicle.add(MAVLink, "Transports.MAVLink", links=links, vehicle_kind=kind, **options)
        self.log_book, self.replies, self.lines = [], [], []
        self.vehicle.start()
        self.vehicle.run(20.0)
        self.vehicle.observe(imc.PlanControl, self.replies.append)
        self.vehicle.observe(imc.LogBookEntry, lambda entry: self.log_book.append(entry.text))

    def connect(self, room=0):
        system_id = mavlink_system_id(self.vehicle.system)
        self.lines.append(Line(self.port, 255 - len(self.lines), system_id, room))
        self.vehicle.run(0.1)
        return self.lines[-1]

    def close(self):
        for line in self.lines:
            line.socket.close()
        self.vehicle.close()

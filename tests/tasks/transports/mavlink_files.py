"""A vehicle that only has files, on a UDP port of its own: MAVLink's file and log transfers, as a session does them."""

import os
import random
import socket
import threading
import time
from contextlib import contextmanager

from mavlink import encode, split
from mavlink.vehicle.files.ftp_messages import LAYOUT, NAK, FtpErrorCode, FtpOpcode
from mavlink.vehicle.files.ftp_server import FtpServer
from mavlink.vehicle.files.log_server import LogServer
from mavlink.vehicle.files.virtual_files import VirtualFiles
from tasks.transports.mavlink_links.ftp_folders import DiskFolders
from tests.tasks.transports.mavlink_station import DIALECT, HOST

SYSTEM = 26
PACKETS = 8  # at a time
STATION = (255, 190)
SECRET = b"outside of the folder"
TEXT = bytes(range(256)) * 4
LOG = b"/logs/20240102/030405_dive/Data.lsf"
HEARTBEAT = {"type": 12, "autopilot": 12, "base_mode": 1, "system_status": 3, "mavlink_version": 3}
CAPABILITIES = 32 | 8192  # files, MAVLink 2


def vehicle_files(folder):
    """The files of a vehicle whose logs are in a folder, and whose folder of pictures is missing."""
    folders = DiskFolders({"logs": folder / "logs", "@MAV_LOG": folder / "logs", "pictures": folder / "missing"})
    return VirtualFiles({"general.json": lambda: b"{}", "@PARAM/param.pck": lambda: b"packed"}, folders)


class Port(threading.Thread):
    """Loses a share of what it gets and sends, and takes another share twice, from the first burst on: pymavlink asks
    thrice for a file to be opened, and then gives up."""

    def __init__(self, tree, *, loss=0.0, twice=0.0, first=0, station=None):
        super().__init__(daemon=True)
        self.files, self.logs, self.first = FtpServer(tree), LogServer(tree, b"logs"), first
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((HOST, 0))
        self.socket.settimeout(0.001)
        self.port = self.socket.getsockname()[1]
        self.random, self.loss, self.twice = random.Random(1), loss, twice
        self.station, self.sequence, self.asker, self.running = station, 0, (0, 0), True
        self.beat, self.troubled = 0.0, False

    def run(self):
        while self.running:
            try:
                datagram, self.station = self.socket.recvfrom(2048)
            except TimeoutError:
                datagram = b""
            for message in split(datagram, DIALECT)[0]:
                for _ in range(self.copies()):
                    self.hear(message)
            if self.station is not None and time.monotonic() > self.beat:
                self.send("HEARTBEAT", **HEARTBEAT)
                self.beat = time.monotonic() + 1.0
            self.pump()

    def hear(self, message):
        now = time.monotonic()
        if message.name == "COMMAND_LONG" and message.values["param1"] == 148:
            self.send("COMMAND_ACK", command=message.values["command"])
            self.send("AUTOPILOT_VERSION", capabilities=CAPABILITIES, uid=1)
        elif message.name == "FILE_TRANSFER_PROTOCOL":
            payload = bytes(message.values["payload"])
            self.asker = (message.system, message.component)
            self.send_file(self.files.receive(self.asker, payload, now))
            self.troubled |= payload[3] == FtpOpcode.BURST
        else:
            self.asker = (message.system, message.component)
            self.logs.receive(self.asker, message.name, message.values, now, first=self.first)

    def pump(self):
        now = time.monotonic()
        for _ in range(PACKETS):
            if self.files.is_busy(self.asker):
                self.send_file(self.files.next_payload(self.asker, now))
            if (answer := self.logs.next_message(self.asker, now)) is not None:
                self.send(answer[0], **answer[1])

    def send_file(self, payload):
        if payload is not None:
            system, component = self.asker
            target = {"target_system": system, "target_component": component}
            self.send("FILE_TRANSFER_PROTOCOL", **target, payload=payload)

    def send(self, name, **fields):
        definition = DIALECT.by_name[name]
        frame = encode(definition, definition.pack(fields), self.sequence & 0xFF, SYSTEM, 1)
        self.sequence += 1
        for _ in range(self.copies()):
            self.socket.sendto(frame, self.station)

    def copies(self):
        if not self.troubled:
            return 1
        return 0 if self.random.random() < self.loss else 2 if self.random.random() < self.twice else 1


@contextmanager
def serving(tree, **how):
    port = Port(tree, **how)
    port.start()
    try:
        yield port
    finally:
        port.running = False
        port.join()
        port.files.close()
        port.logs.close()
        port.socket.close()


def request(opcode, data=b"", *, sequence=0, session=0, offset=0, size=None):
    """The payload of a request."""
    return LAYOUT.pack(sequence, session, opcode, len(data) if size is None else size, 0, 0, offset) + data


def taken(payload):
    """(sequence, session, opcode, requested opcode, complete, offset, data) of an answer."""
    sequence, session, opcode, size, asked, complete, offset = LAYOUT.unpack_from(payload)
    assert len(payload) == LAYOUT.size + size <= 251
    return sequence, session, opcode, asked, complete, offset, payload[LAYOUT.size :]


def meaning(payload):
    """The data of an answer, or why there is none."""
    _, _, kind, _, _, _, data = taken(payload)
    return FtpErrorCode(data[0]) if kind == NAK else data


def ask(server, opcode, data=b"", *, asker=STATION, now=0.0, **how):
    return meaning(server.receive(asker, request(opcode, data, **how), now))


def listing(server, path, opcode=FtpOpcode.LIST):
    """All lines of a folder."""
    found = []
    while (answer := ask(server, opcode, path, offset=len(found))) != FtpErrorCode.END:
        assert answer.endswith(b"\0")
        found += answer[:-1].split(b"\0")
    return found


def fill(root):
    """Make logs, and beside them what nobody may read, with ways that lead there."""
    log = root / "logs/20240102/030405_dive"
    log.mkdir(parents=True)
    (log / "Data.lsf").write_bytes(TEXT)
    (log / "empty").write_bytes(b"")
    (log / "a tab\there").write_bytes(b"tab")
    (log / "Käse 🧀\n").write_bytes(b"cheese")
    (log / os.fsdecode(b"\xff\xfe odd")).write_bytes(b"odd")
    (root / "secret").write_bytes(SECRET)
    (root / "logs/way_out").symlink_to(root)
    (root / "logs/secret").symlink_to(root / "secret")
    (root / "logs/inside").symlink_to(log)
    (root / "logs/null").symlink_to("/dev/null")
    os.mkfifo(root / "logs/pipe")
    return root

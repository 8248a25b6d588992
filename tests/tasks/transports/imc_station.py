"""A shipped vehicle in real time with its network tasks at ports of its own, and systems that talk to it."""

import contextlib
import socket
import threading
import time

import imc
from imc.discovery import Service, Services
from runtime.kernel import WallClock
from runtime.profile import load_profile
from runtime.vehicle import build
from tests.outside import PATIENCE, free_ports, until

CONSOLE = 0x4042


class Afloat:
    """A vehicle that runs in its own thread."""

    def __init__(self, profile, root, *settings, clock=None):
        loaded = load_profile(profile)
        self.ports = free_ports(2)
        ports = ", ".join(map(str, self.ports))
        for setting in (
            f"Transports.Announce:Ports={ports}",
            f"Transports.Discovery:Ports={ports}",
            "Transports.UDP:Local Port=0",
            "Transports.MAVLink:Enabled=Never",
            *settings,
        ):
            loaded.override(setting)
        self.vehicle = build(loaded, {"Simulation"}, clock=clock or WallClock(), log_root=root, keep_going=True).vehicle
        self.messages, self.log = [], []
        self.vehicle.observe(imc.LogBookEntry, lambda entry: self.log.append(entry.text))
        self.udp, self.discovery = self.vehicle.task("Transports.UDP"), self.vehicle.task("Transports.Discovery")

    def start(self, wait=True):
        self.vehicle.start()
        self._thread = threading.Thread(target=self.vehicle.run, daemon=True)
        self._thread.start()
        self.until(lambda: getattr(self.udp, "port", 0) and (not wait or getattr(self.discovery, "port", 0)))

    def close(self):
        self.vehicle.kernel.post(self.vehicle.stop)
        self._thread.join(PATIENCE)
        self.vehicle.close()

    def hears(self, kind):
        """The messages of a type that the vehicle's tasks get from now on."""
        found, begun = [], threading.Event()
        self.vehicle.kernel.post(self.vehicle.observe, kind, found.append)
        self.vehicle.kernel.post(begun.set)
        assert begun.wait(PATIENCE)
        return found

    def until(self, condition, patience=PATIENCE):
        """Wait for a condition; returns what made it true."""
        return until(condition, patience, every=0.01, told=lambda: f"log: {self.log}")

    def logged(self, part):
        return self.until(lambda: [text for text in self.log if part in text])


@contextlib.contextmanager
def afloat(root, *settings, profile="lauv-noptilus-1", wait=True, clock=None):
    vehicle = Afloat(profile, root, *settings, clock=clock)
    vehicle.start(wait)
    try:
        yield vehicle
    finally:
        vehicle.close()


class Station:
    """A system with one socket, which speaks plain IMC over UDP."""

    def __init__(self, afloat, system=CONSOLE, name="ccu-test", address="127.0.0.1", port=0):
        self.afloat, self.system, self.name, self.address = afloat, system, name, address
        self.move(address, port)

    def move(self, address=None, port=0):
        """Go to another address or port."""
        self.address = address or self.address
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((self.address, port))
        self.socket.setblocking(False)
        self.port = self.socket.getsockname()[1]

    @property
    def services(self):
        return str(Services.from_system_info([Service("imc+udp", self.address, self.port)], uid=self.system))

    def announce(self, services=None, port=None, **fields):
        text = self.services if services is None else services
        fields = {"sys_name": self.name, "services": text, "dst": 0, **fields}
        self.send(imc.Announce(**fields), port or self.afloat.discovery.port)

    def send(self, message, port=None, order="little"):
        message = message.replace(timestamp=time.time(), src=message.src if message.src != 0xFFFF else self.system)
        self.send_bytes(imc.encode(message, order), port)

    def send_bytes(self, data, port=None):
        self.socket.sendto(data, ("127.0.0.1", port or self.afloat.udp.port))

    def join(self):
        """Announce, and send a first packet."""
        before = self.afloat.udp.peers.find(self.system)
        before = before.announced if before else 0.0
        self.announce()
        self.afloat.until(lambda: (p := self.afloat.udp.peers.find(self.system)) and p.announced > before)
        self.send(imc.Heartbeat())
        return self

    def packets(self):
        """What has arrived."""
        found = []
        while True:
            try:
                found.append(self.socket.recv(65535))
            except BlockingIOError:
                return found

    def messages(self, kind=imc.Message):
        return [m for m in map(imc.decode, self.packets()) if isinstance(m, kind)]

    def during(self, seconds, kind=imc.Message):
        """The messages of a type that arrive in some seconds."""
        self.packets()
        end, found = time.monotonic() + seconds, []
        while time.monotonic() < end:
            found += self.messages(kind)
            time.sleep(0.01)
        return found

    def get(self, kind, patience=PATIENCE):
        """The next message of a type."""
        return self.afloat.until(lambda: self.messages(kind), patience)[0]

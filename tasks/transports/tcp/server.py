"""IMC over TCP for those who connect."""

import socket

import imc
from imc.discovery import Service
from runtime import State, param
from runtime.networks import is_local
from tasks.transports.imc_links.announcement import EXTERNAL, LOCAL
from tasks.transports.imc_links.sockets import network_address
from tasks.transports.imc_links.streams import Stream, StreamCarrier

PORTS_TRIED = 6  # from Port on, as in DUNE
AT_ONCE = 8  # connections accepted at a time
PAUSE = 0.01  # s, after so many
REFUSED = "connections refused, since there were too many"


class Server(StreamCarrier):
    """Exchanges IMC packets with the programs that connect; nobody has to announce itself.

    A client that leaves much unread, sends what is no IMC, or has vanished, is cut off. Nothing goes back to its
    sender. A client may also connect for one packet only.
    """

    address: str = param(
        "",
        "",
        "Where to listen; empty means [General] Network Address: 127.0.0.1 is this computer only.",
        editable=False,
    )
    port: int = param(
        7001,
        "1",
        "Port to listen at; if it is taken, one of the next five, else any. 0 takes any.",
        minimum=0,
        maximum=65535,
        editable=False,
    )
    announce_service: bool = param(
        True, "", "Announce the server; Neptus then sends its commands by TCP.", editable=False
    )
    maximum_connections: int = param(32, "1", "Most connections at a time.", minimum=1, maximum=256)

    def configure(self) -> None:
        self.place = network_address(self, self.address)
        super().configure()

    def start(self) -> None:
        self.listener: socket.socket | None = None
        self.trouble, self.open_port = "", 0
        super().start()
        self.open()

    def stop(self) -> None:
        super().stop()
        if self.listener is not None:
            self.unwatch(self.listener)
            self.listener.close()
            self.listener = None

    def open(self) -> None:
        """Listen, at the first port that is free; if that fails, the reason is logged once."""
        trouble = ""
        first = self.port
        for port in [*range(first, min(first + PORTS_TRIED, 65536)), 0] if first else [0]:
            opened = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
            try:
                opened.setblocking(False)
                opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # connections of an earlier run may linger
                opened.bind((self.place, port))
                opened.listen()
            except OSError as error:
                opened.close()
                trouble = f"cannot listen at {self.place}: {error.strerror}"
                continue
            self.listener, self.trouble, self.open_port = opened, "", opened.getsockname()[1]
            self.watch(opened, self.accept)
            self.tell_opened()
            return
        if trouble != self.trouble:
            self.log.error(trouble)
        self.trouble = trouble

    def tell_opened(self) -> None:
        local = is_local(self.place)
        if not local:
            who = f"only {', '.join(self.consoles)} may" if self.commanders.listed else "whoever reaches it can"
            self.log.warning(f"listens at {self.place}:{self.open_port} without passwords: {who} command the vehicle")
        if self.port not in (0, self.open_port):
            self.log.info(f"port {self.port} is taken: listens at {self.open_port}")
        if self.announce_service:
            service = str(Service("imc+tcp", self.place, self.open_port))
            self.publish(imc.AnnounceService(service=service, service_type=LOCAL if local else LOCAL | EXTERNAL))

    def accept(self) -> None:
        """Take some connections; if there are more, after a pause."""
        assert self.listener is not None
        for _ in range(AT_ONCE):
            try:
                opened, (address, port) = self.listener.accept()
            except BlockingIOError:
                return
            except OSError as error:  # it has gone already, or there are no file descriptors left
                if self.drops.add(f"connections failed ({error.strerror})", "anybody"):
                    self.log.warning(f"a connection failed: {error.strerror}")
                break
            if len(self.streams) < self.maximum_connections:
                self.adopt(Stream(opened, address, f"{address}:{port}", self.now))
                continue
            opened.close()
            if self.drops.add(REFUSED, address):
                self.log.warning(f"{self.maximum_connections} are connected: {address} was refused")
        self.unwatch(self.listener)
        self.after(PAUSE, self.go_on_accepting)

    def go_on_accepting(self) -> None:
        if self.listener is not None:
            self.watch(self.listener, self.accept)

    def report(self) -> None:
        if self.listener is None:
            self.open()
        figures = self.trouble or f"port {self.open_port}: {self.figures()}"
        self.set_entity_state(State.ERROR if self.trouble else State.NORMAL, figures)

"""IMC over TCP for those who connect."""

import socket
from collections import Counter

import imc
from imc.console_acl import listed_systems
from imc.discovery import PERIOD, Service
from runtime import State, consume, param
from support.log_limit import LogLimit, Trouble
from tasks.transports.imc_links.link_task import reraise_as_parameter_error
from tasks.transports.imc_links.port_search import announce_listening_service, listening_socket
from tasks.transports.imc_links.sockets import (
    listen_address,
    listen_address_param,
    network_silence,
    network_time,
    schedule_network_timer,
)
from tasks.transports.imc_links.stream_links import PacketStream, StreamLinkTask
from tasks.transports.imc_links.vehicle_peers import VehiclePeers

PORTS_TRIED = 6  # from Port on, as in DUNE
AT_ONCE = 8  # connections accepted at a time
IDLE = 1.0  # s without a packet after which a connection may have to give way
PAUSE = 0.01  # s, after so many
SILENT_FOR = 2.5  # s until a client that sends nothing is taken for a console; a DUNE sends Heartbeat at 1 Hz
UNKNOWN_FOR = PERIOD + 1.0  # s until a system that does not announce itself is taken for no vehicle
REFUSED = "connections rejected, since there were too many"
GAVE_WAY = "connections ended for others"


class Server(StreamLinkTask):
    """Exchanges IMC packets with the programs that connect, without announcements.

    A client that leaves much unread, sends what is no IMC, or has vanished, is cut off. Nothing goes back to its
    sender. A client may also connect for one packet only. If there are too many, one that was idle for a second gives
    way, or one of another address that has more than half of them. It is sent the listed messages as soon as it is
    known: a console by its first packet, others by their Announce, after eleven seconds without one, and after 2.5 s
    without any packet. Another vehicle is sent nothing, unless `Call Systems` names it.
    """

    address: str = listen_address_param()
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
    call_systems: list[str] = param(
        [], "", "Other vehicles, by name or id, that get messages when they connect.", editable=False
    )
    maximum_connections: int = param(32, "1", "Most connections at a time.", minimum=1, maximum=256, editable=False)

    def configure(self) -> None:
        self.place: str = listen_address(self, self.address)
        called = reraise_as_parameter_error(
            "Call Systems", lambda: listed_systems(self.call_systems, self.vehicle.systems.id)
        )
        if not hasattr(self, "vehicles"):  # they stay if parameters change, or the task is restarted
            self.vehicles: VehiclePeers = VehiclePeers(self.system)
        self.vehicles.called = called
        super().configure()

    def start(self) -> None:
        self.listener: socket.socket | None = None
        self.trouble: Trouble = Trouble()
        self.open_port = 0
        self.vehicle_lines: LogLimit = LogLimit("more vehicles connect and get nothing")
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
        try:
            self.listener = listening_socket(self.place, self.port, PORTS_TRIED)
        except OSError as error:
            self.trouble.report(f"cannot listen at {self.place}: {error.strerror}", self.log.error)
            return
        self.trouble.end()
        self.open_port: int = self.listener.getsockname()[1]
        self.watch(self.listener, self.accept)
        service = Service("imc+tcp", self.place, self.open_port)
        announce_listening_service(self, service, self.port, self.commanders.risk, announced=self.announce_service)

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
            if len(self.streams) < self.maximum_connections or self.make_room(address):
                stream = PacketStream(opened, address, f"{address}:{port}", network_time(self), self.maximum_rate)
                self.add_stream(stream)
                schedule_network_timer(self, SILENT_FOR, self.greet_silent, stream)
                continue
            opened.close()
            if self.drops.add(REFUSED, address):
                self.log.warning(f"{self.maximum_connections} are connected: {address} was rejected")
        self.unwatch(self.listener)
        schedule_network_timer(self, PAUSE, self.resume_accepting)

    @consume(others=True)
    def on_announce(self, other: imc.Announce) -> None:
        self.vehicles.on_announce(other)

    def on_message(self, stream: PacketStream, message: imc.Message) -> None:
        if isinstance(message, imc.Announce):
            self.vehicles.on_announce(message)
        self.greet_if_known(stream, any(map(self.vehicles.is_no_vehicle, stream.systems)))
        if stream.taken == 1:
            schedule_network_timer(self, UNKNOWN_FOR, self.greet_if_known, stream, True)

    def greet_if_known(self, stream: PacketStream, is_known: bool) -> None:
        if stream.greeted:
            return
        if self.withholds(stream):
            stream.greeted = True
            text = f"{stream.name} is another vehicle and gets nothing, since Call Systems does not name it"
            self.vehicle_lines.write(self.log.info, text, network_time(self))
        elif is_known:
            self.greet(stream)

    def greet_silent(self, stream: PacketStream) -> None:
        if not stream.taken:
            self.greet(stream)

    def withholds(self, stream: PacketStream) -> bool:
        return bool(stream.systems) and all(map(self.vehicles.withholds, stream.systems))

    def make_room(self, address: str) -> bool:
        """Close the least important connection, so that many cannot shut out an operator."""
        count = Counter(stream.address for stream in self.streams)

        def is_fair(stream: PacketStream) -> bool:
            return count[stream.address] <= self.maximum_connections // 2

        def worth(stream: PacketStream) -> tuple[bool, bool, float]:
            return is_fair(stream), stream.commands, stream.received_at

        spare = [
            stream
            for stream in self.streams
            if network_silence(self, stream.received_at) > IDLE or not (is_fair(stream) or stream.address == address)
        ]
        if not spare:
            return False
        least = min(spare, key=worth)
        self.close_stream(least, "too many are connected", warn=self.drops.add(GAVE_WAY, least.address))
        return True

    def resume_accepting(self) -> None:
        if self.listener is not None:
            self.watch(self.listener, self.accept)

    def report(self) -> None:
        if self.listener is None:
            self.open()
        reason = self.trouble.reason
        figures = reason or f"port {self.open_port}: {self.statistics_text()}"
        self.set_entity_state(State.ERROR if reason else State.NORMAL, figures)

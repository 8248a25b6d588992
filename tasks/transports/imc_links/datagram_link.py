"""The options of IMC over UDP, and what they make: who may send, who is sent what, and how far it reaches."""

from imc.console_acl import listed_systems
from imc.discovery import Endpoint
from imc.schema import message_named
from runtime import param
from runtime.profile import split_list
from tasks.transports.imc_links.datagram_filter import DatagramFilter
from tasks.transports.imc_links.datagram_routes import DatagramRoutes, parse_endpoint, parse_peer_rate
from tasks.transports.imc_links.link_task import ImcLinkTask, reraise_as_parameter_error
from tasks.transports.imc_links.message_list import MessageList, parse_rate
from tasks.transports.imc_links.peer_table import PeerTable
from tasks.transports.imc_links.radio_range import RadioRange
from tasks.transports.imc_links.sockets import listen_address, listen_address_param, network_silence
from tasks.transports.imc_links.vehicle_peers import VehiclePeers


class DatagramLinkTask(ImcLinkTask):
    """Options of a link by datagrams; a subclass sends and receives.

    They make `peers` and their `gate`, `vehicles` that get nothing, `routes` to those that get something, and `reach`,
    the range of a simulated radio or None.
    """

    address: str = listen_address_param()
    local_port: int = param(
        6002,
        "1",
        "Port to listen at; if it is taken, one of the next four, else any. 0 takes any.",
        minimum=0,
        maximum=65535,
        editable=False,
    )
    announce_service: bool = param(True, "", "Announce where to send packets to this vehicle.", editable=False)
    dynamic_nodes: bool = param(True, "", "Send to the systems that announce themselves.", editable=False)
    call_systems: list[str] = param(
        [],
        "",
        "Systems, by name or id, to which to send once they announce themselves; others first have to send, and "
        "other vehicles get nothing.",
        editable=False,
    )
    static_destinations: list[str] = param(
        [], "", "Destinations that always receive, ADDRESS:PORT.", usable=parse_endpoint, editable=False
    )
    ignore_filter: bool = param(
        False, "", "Take packets of systems that have not announced themselves.", editable=False
    )
    contact_timeout: float = param(30.0, "s", "Silence after which a system gets no more packets.", editable=False)
    maximum_rate: float = param(
        2000.0, "Hz", "Most packets per second that a system may send.", minimum=1, editable=False
    )
    communication_range: float = param(
        0.0, "m", "Range of the simulated radio, in mode Simulation; 0 or less is unlimited."
    )
    underwater_communications: bool = param(False, "", "Let the simulated radio also work under water.")
    always_transmitted_messages: list[str] = param(
        ["Abort", "SimulatedState"],
        "",
        "Messages that the simulated radio carries at any range.",
        usable=message_named,
        editable=False,
    )
    peer_rates: list[str] = param(
        [], "", "Rates for one system instead of Rate Limiters, SYSTEM/MESSAGE:HZ.", usable=parse_peer_rate
    )

    def configure_peers(self) -> None:
        id_of = self.vehicle.systems.id
        self.place: str = listen_address(self, self.address)
        self.static: list[Endpoint] = reraise_as_parameter_error(
            "Static Destinations", lambda: [parse_endpoint(item) for item in self.static_destinations]
        )
        if not hasattr(self, "peers"):  # they stay if parameters change, or the task is restarted
            self.peers: PeerTable = PeerTable(silence=lambda since, _: network_silence(self, since))
            self.positions: RadioRange = RadioRange()
            self.vehicles: VehiclePeers = VehiclePeers(self.system)
        self.peers.timeout, self.peers.rate = self.contact_timeout, self.maximum_rate
        self.peers.kept = self.commanders.listed
        self.peers.called = self.vehicles.called = reraise_as_parameter_error(
            "Call Systems", lambda: listed_systems(self.call_systems, id_of)
        )
        self.gate: DatagramFilter = DatagramFilter(
            self.system,
            self.peers,
            self.commanders,
            static=self.static,
            ignore_filter=self.ignore_filter,
        )
        self.reach: RadioRange | None = None
        if self.communication_range > 0.0 and "Simulation" in split_list(
            self.vehicle.profile.value("General", "Selected", "")
        ):
            schema = self.vehicle.bus.messages
            always = [schema[name].ID for name in self.always_transmitted_messages if name in schema]
            self.reach = self.positions
            self.reach.set_limits(self.communication_range, self.underwater_communications, always)
        self.routes: DatagramRoutes = DatagramRoutes(self.messages, self.lists_with_peer_rates(), self.static)

    def lists_with_peer_rates(self) -> dict[int, MessageList]:
        """The lists of the systems that `Peer Rates` names. Raises ParameterError."""
        own: dict[int, list[str]] = {}
        for name, rate in reraise_as_parameter_error(
            "Peer Rates", lambda: [parse_peer_rate(item) for item in self.peer_rates]
        ):
            (system,) = reraise_as_parameter_error(
                "Peer Rates", lambda name=name: listed_systems([name], self.vehicle.systems.id)
            )
            own.setdefault(system, []).append(rate)
        return {
            system: self.message_list(
                [*self.transports, *(parse_rate(rate)[0] for rate in rates)], [*self.rate_limiters, *rates]
            )
            for system, rates in own.items()
        }

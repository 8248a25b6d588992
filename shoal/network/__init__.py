"""Running vehicles: who is there, what they say, their plans and parameters."""

from shoal.network.blocking import Connection, RemoteLogs, RemoteParameters, RemotePlans, RemoteVehicle
from shoal.network.diagnosis import Contact, Diagnosis, Finding, diagnose
from shoal.network.endpoints import connect, make_network
from shoal.network.link import NEAR, Arrival, Console, Ear, Link, NetworkError
from shoal.network.listener import Listener
from shoal.network.logs import Logs, RemoteLog
from shoal.network.message_filter import field_of, parse_where
from shoal.network.network import Network, NoAnswer, VehicleLost
from shoal.network.parameters import Parameters, check_parameter
from shoal.network.plans import Outcome, Plans, Refused, StoredPlan
from shoal.network.remote_vehicle import AsyncRemoteVehicle
from shoal.network.system_table import System
from shoal.network.tcp_link import TCPLink
from shoal.network.udp_link import UDPLink
from shoal.network.zenoh_link import ZenohLink

__all__ = [
    "NEAR",
    "Arrival",
    "AsyncRemoteVehicle",
    "Connection",
    "Console",
    "Contact",
    "Diagnosis",
    "Ear",
    "Finding",
    "Link",
    "Listener",
    "Logs",
    "Network",
    "NetworkError",
    "NoAnswer",
    "Outcome",
    "Parameters",
    "Plans",
    "Refused",
    "RemoteLog",
    "RemoteLogs",
    "RemoteParameters",
    "RemotePlans",
    "RemoteVehicle",
    "StoredPlan",
    "System",
    "TCPLink",
    "UDPLink",
    "VehicleLost",
    "ZenohLink",
    "check_parameter",
    "connect",
    "diagnose",
    "field_of",
    "make_network",
    "parse_where",
]

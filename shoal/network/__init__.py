"""Running vehicles: their presence, messages, plans and parameters."""

from autonomy.plans import PlanEstimate, format_percent
from shoal.network.blocking import RemoteLogs, RemoteParameters, RemotePlans, RemoteVehicle, VehicleConnection
from shoal.network.diagnosis import Contact, Diagnosis, diagnose
from shoal.network.link import (
    NEAR,
    ConsoleIdentity,
    LinkListener,
    NetworkError,
    NetworkLink,
    NoAnswer,
    ReceivedPacket,
    Refused,
    Unlisted,
    VehicleLost,
)
from shoal.network.logs import AsyncRemoteLogs, RemoteLog
from shoal.network.message_filter_expression import field_value, parse_message_filter
from shoal.network.message_listener import MessageListener
from shoal.network.message_requests import MessageUse
from shoal.network.network import Network
from shoal.network.network_factory import connect, make_network
from shoal.network.parameter_descriptions import ParameterDescription, describe_parameters
from shoal.network.parameter_file import (
    FileSection,
    FileValue,
    ParameterFileError,
    VehicleParameters,
    parameter_file_text,
    read_parameter_file,
)
from shoal.network.parameter_transfer import (
    ParameterOutcome,
    PlannedChange,
    UnfitParameters,
    check_parameters,
    dump_parameters,
    load_parameters,
)
from shoal.network.parameters import AsyncRemoteParameters, PartialAnswer, check_parameter_name, is_same_value
from shoal.network.plans import AsyncRemotePlans, PlanOutcome, StoredPlan
from shoal.network.recording import NetworkRecorder, RecordingEnd, VehicleRecording
from shoal.network.remote_vehicle import AsyncRemoteVehicle
from shoal.network.system_table import CONTACT, SILENCE, NetworkSystem
from shoal.network.tcp_link import TCPLink
from shoal.network.udp_link import UDPLink
from shoal.network.zenoh_link import ZenohLink

__all__ = [
    "CONTACT",
    "NEAR",
    "SILENCE",
    "AsyncRemoteLogs",
    "AsyncRemoteParameters",
    "AsyncRemotePlans",
    "AsyncRemoteVehicle",
    "ConsoleIdentity",
    "Contact",
    "Diagnosis",
    "FileSection",
    "FileValue",
    "LinkListener",
    "MessageListener",
    "MessageUse",
    "Network",
    "NetworkError",
    "NetworkLink",
    "NetworkRecorder",
    "NetworkSystem",
    "NoAnswer",
    "ParameterDescription",
    "ParameterFileError",
    "ParameterOutcome",
    "PartialAnswer",
    "PlanEstimate",
    "PlanOutcome",
    "PlannedChange",
    "ReceivedPacket",
    "RecordingEnd",
    "Refused",
    "RemoteLog",
    "RemoteLogs",
    "RemoteParameters",
    "RemotePlans",
    "RemoteVehicle",
    "StoredPlan",
    "TCPLink",
    "UDPLink",
    "UnfitParameters",
    "Unlisted",
    "VehicleConnection",
    "VehicleLost",
    "VehicleParameters",
    "VehicleRecording",
    "ZenohLink",
    "check_parameter_name",
    "check_parameters",
    "connect",
    "describe_parameters",
    "diagnose",
    "dump_parameters",
    "field_value",
    "format_percent",
    "is_same_value",
    "load_parameters",
    "make_network",
    "parameter_file_text",
    "parse_message_filter",
    "read_parameter_file",
]

"""Serial ports and sockets of a driver, and how their bytes become lines and frames."""

from runtime.devices.connections import (
    Address,
    Connection,
    SerialPort,
    TcpConnection,
    TcpServerAddress,
    UdpSocket,
    resolve_host,
)
from runtime.devices.device import Device, DeviceLog, DeviceOwner
from runtime.devices.framing import FrameSplitter, LineSplitter, RawChunks, Splitter, line_size_function, parse_number
from runtime.devices.scripted_input import InputScript, ScriptedInputs, TimedData
from runtime.devices.tcp_request import TcpRequester

__all__ = [
    "Address",
    "Connection",
    "Device",
    "DeviceLog",
    "DeviceOwner",
    "FrameSplitter",
    "InputScript",
    "LineSplitter",
    "RawChunks",
    "ScriptedInputs",
    "SerialPort",
    "Splitter",
    "TcpConnection",
    "TcpRequester",
    "TcpServerAddress",
    "TimedData",
    "UdpSocket",
    "line_size_function",
    "parse_number",
    "resolve_host",
]

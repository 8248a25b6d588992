"""Serial ports and sockets of a driver, and how their bytes become lines and frames."""

from runtime.devices.addresses import Address, Connection, SerialPort, TcpConnection, TcpServer, UdpSocket, look_up
from runtime.devices.device import Device, Log, Owner
from runtime.devices.framing import Frames, Lines, Splitter, Whole, lines_of, number
from runtime.devices.scripted_input import Piece, Recording, Recordings
from runtime.devices.tcp_request import Exchange

__all__ = [
    "Address",
    "Connection",
    "Device",
    "Exchange",
    "Frames",
    "Lines",
    "Log",
    "Owner",
    "Piece",
    "Recording",
    "Recordings",
    "SerialPort",
    "Splitter",
    "TcpConnection",
    "TcpServer",
    "UdpSocket",
    "Whole",
    "lines_of",
    "look_up",
    "number",
]

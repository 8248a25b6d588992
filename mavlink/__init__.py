"""MAVLink without sockets: messages, frames, signatures, modes, and the logs of ground stations and autopilots."""

from mavlink import dataflash, positions, statustext, ulog
from mavlink.dialect import Dialect, Fields, load_dialect
from mavlink.frames import LONGEST_DATAGRAM, Received, StreamSplitter, encode, split
from mavlink.log_records import Record
from mavlink.modes import (
    ARMED,
    AUTOPILOT_NONE,
    CRITICAL,
    CUSTOM_MODE,
    EMERGENCY,
    FLAVOURS,
    GROUND_STATION,
    KINDS,
    STANDARD_MODES,
    STANDBY,
    STATUS,
    Flavour,
    Kind,
    Mode,
    mode_number,
    mode_of,
    moving,
)
from mavlink.positions import Home
from mavlink.signing import UNSIGNED, Signing, SigningTime, parse_key, read_key
from mavlink.statustext import chunks
from mavlink.system_ids import SYSTEMS, system_of
from mavlink.tlog import Recorded, Tlog

__all__ = [
    "ARMED",
    "AUTOPILOT_NONE",
    "CRITICAL",
    "CUSTOM_MODE",
    "EMERGENCY",
    "FLAVOURS",
    "GROUND_STATION",
    "KINDS",
    "LONGEST_DATAGRAM",
    "STANDARD_MODES",
    "STANDBY",
    "STATUS",
    "SYSTEMS",
    "UNSIGNED",
    "Dialect",
    "Fields",
    "Flavour",
    "Home",
    "Kind",
    "Mode",
    "Received",
    "Record",
    "Recorded",
    "Signing",
    "SigningTime",
    "StreamSplitter",
    "Tlog",
    "chunks",
    "dataflash",
    "encode",
    "load_dialect",
    "mode_number",
    "mode_of",
    "moving",
    "parse_key",
    "positions",
    "read_key",
    "split",
    "statustext",
    "system_of",
    "ulog",
]

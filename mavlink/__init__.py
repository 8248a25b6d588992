"""MAVLink without sockets: messages, frames, signatures, modes, and the logs of ground stations and autopilots."""

from mavlink import dataflash, positions, statustext, ulog
from mavlink.dialect import Dialect, Fields, load_dialect
from mavlink.frames import LONGEST_DATAGRAM, ReceivedMessage, StreamSplitter, encode, split
from mavlink.link_url import SERIAL, LinkUrl, parse_link_url
from mavlink.log_record_scanner import LogRecord
from mavlink.modes import (
    ARMED,
    AUTOPILOT_NONE,
    CRITICAL,
    CUSTOM_MODE,
    EMERGENCY,
    FLAVORS,
    GROUND_STATION,
    KINDS,
    STANDARD_MODES,
    STANDBY,
    STATUS,
    Flavor,
    Mode,
    VehicleKind,
    is_maneuvering,
    mode_number,
    mode_of,
)
from mavlink.positions import Home, home_at
from mavlink.signing import UNSIGNED, Signing, SigningTime, parse_key, read_key
from mavlink.statustext import chunks
from mavlink.system_ids import SYSTEMS, mavlink_system_id
from mavlink.tlog import RecordedMessage, Tlog, lacks_times

__all__ = [
    "ARMED",
    "AUTOPILOT_NONE",
    "CRITICAL",
    "CUSTOM_MODE",
    "EMERGENCY",
    "FLAVORS",
    "GROUND_STATION",
    "KINDS",
    "LONGEST_DATAGRAM",
    "SERIAL",
    "STANDARD_MODES",
    "STANDBY",
    "STATUS",
    "SYSTEMS",
    "UNSIGNED",
    "Dialect",
    "Fields",
    "Flavor",
    "Home",
    "LinkUrl",
    "LogRecord",
    "Mode",
    "ReceivedMessage",
    "RecordedMessage",
    "Signing",
    "SigningTime",
    "StreamSplitter",
    "Tlog",
    "VehicleKind",
    "chunks",
    "dataflash",
    "encode",
    "home_at",
    "is_maneuvering",
    "lacks_times",
    "load_dialect",
    "mavlink_system_id",
    "mode_number",
    "mode_of",
    "parse_key",
    "parse_link_url",
    "positions",
    "read_key",
    "split",
    "statustext",
    "ulog",
]

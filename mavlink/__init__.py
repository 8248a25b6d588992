"""MAVLink without sockets: messages, frames, .tlog files, and conversion to and from IMC."""

from mavlink import cameras, dataflash, from_dataflash, from_imc, from_ulog, instruments, text, ulog
from mavlink.dialect import Dialect, Fields, load_dialect
from mavlink.dialogues import DialogueTranslator
from mavlink.frames import LONGEST_DATAGRAM, Received, StreamSplitter, encode, split
from mavlink.from_imc import SYSTEMS, system_of
from mavlink.link_url import SERIAL, LinkUrl, parse_link_url
from mavlink.meanings import ENTITIES, Flight
from mavlink.modes import (
    ARMED,
    CRITICAL,
    CUSTOM_MODE,
    EMERGENCY,
    FLAVOURS,
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
from mavlink.records import Record
from mavlink.signing import UNSIGNED, Signing, SigningTime, parse_key, read_key
from mavlink.text import chunks
from mavlink.tlog import Recorded, Tlog
from mavlink.to_imc import AUTOPILOT_NONE, GROUND_STATION, AutopilotTranslator

__all__ = [
    "ARMED",
    "AUTOPILOT_NONE",
    "CRITICAL",
    "CUSTOM_MODE",
    "EMERGENCY",
    "ENTITIES",
    "FLAVOURS",
    "GROUND_STATION",
    "KINDS",
    "LONGEST_DATAGRAM",
    "SERIAL",
    "STANDARD_MODES",
    "STANDBY",
    "STATUS",
    "SYSTEMS",
    "UNSIGNED",
    "AutopilotTranslator",
    "Dialect",
    "DialogueTranslator",
    "Fields",
    "Flavour",
    "Flight",
    "Kind",
    "LinkUrl",
    "Mode",
    "Received",
    "Record",
    "Recorded",
    "Signing",
    "SigningTime",
    "StreamSplitter",
    "Tlog",
    "cameras",
    "chunks",
    "dataflash",
    "encode",
    "from_dataflash",
    "from_imc",
    "from_ulog",
    "instruments",
    "load_dialect",
    "mode_number",
    "mode_of",
    "moving",
    "parse_key",
    "parse_link_url",
    "read_key",
    "split",
    "system_of",
    "text",
    "ulog",
]

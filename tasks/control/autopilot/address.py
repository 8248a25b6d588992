"""Where an autopilot is: `udpin://127.0.0.1:14550`, `serial:///dev/ttyAMA0?baud=57600`."""

from dataclasses import dataclass
from urllib.parse import parse_qs, urlsplit

from runtime.problem import suggestion

SCHEMES = ("udpin", "udpout", "tcpout", "serial")
FORMS = "udpin://ADDRESS:PORT, udpout://HOST:PORT, tcpout://HOST:PORT or serial:///DEVICE?baud=BAUD"
USUAL_BAUD = 57600
FASTEST_BAUD = 4_000_000


@dataclass(frozen=True, slots=True)
class Place:
    """Where an autopilot is: host and port of a socket, or device and baud rate of a serial port."""

    scheme: str
    host: str = ""
    port: int = 0
    device: str = ""
    baud: int = USUAL_BAUD


def parse_place(text: str) -> Place:
    """Parses the address of an autopilot. Raises ValueError with the reason."""
    scheme, colon, _ = text.strip().partition("://")
    if not colon:
        raise ValueError(f"{text!r} is not {FORMS}")
    if scheme not in SCHEMES:
        raise ValueError(f"{text!r}: {scheme!r} is not a scheme; {suggestion(scheme, SCHEMES)}")
    parts = urlsplit(text.strip())
    if scheme == "serial":
        return _serial(text, parts.path, parts.query)
    try:
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if not host or not port or parts.path or parts.query:
        raise ValueError(f"{text!r} is not {scheme}://HOST:PORT, with a port from 1 to 65535")
    return Place(scheme, host, port)


def _serial(text: str, device: str, query: str) -> Place:
    options = parse_qs(query, keep_blank_values=True)
    baud = options.pop("baud", [str(USUAL_BAUD)])[-1]
    if options:
        raise ValueError(f"{text!r}: {next(iter(options))!r} is not an option; only baud is")
    if not device:
        raise ValueError(f"{text!r} names no device, such as serial:///dev/ttyAMA0")
    if not (baud.isascii() and baud.isdecimal() and 0 < int(baud) <= FASTEST_BAUD):
        raise ValueError(f"{text!r}: {baud!r} is not a baud rate")
    return Place("serial", device=device, baud=int(baud))

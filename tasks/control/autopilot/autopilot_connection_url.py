"""Addresses of autopilots: `udpin://127.0.0.1:14550`, `serial:///dev/ttyAMA0?baud=57600`."""

from collections.abc import Callable
from dataclasses import dataclass
from urllib.parse import parse_qs, urlsplit

from runtime import Task
from runtime.devices import Device
from support.terminal_text import suggestion

SCHEMES = ("udpin", "udpout", "tcpout", "serial")
FORMS = "udpin://ADDRESS:PORT, udpout://HOST:PORT, tcpout://HOST:PORT or serial:///DEVICE?baud=BAUD"
KEY, BAUD = "key", "baud"
USUAL_BAUD = 57600
FASTEST_BAUD = 4_000_000


@dataclass(frozen=True, slots=True)
class AutopilotAddress:
    """The place of an autopilot: host and port of a socket, or device and baud rate of a serial port.

    `key` is the file with the key of a link whose messages are signed, else empty.
    """

    scheme: str
    host: str = ""
    port: int = 0
    device: str = ""
    baud: int = USUAL_BAUD
    key: str = ""


def parse_address(text: str) -> AutopilotAddress:
    """Parses the address of an autopilot. Raises ValueError with the reason."""
    scheme, colon, _ = text.strip().partition("://")
    if not colon:
        raise ValueError(f"{text!r} is not {FORMS}")
    if scheme not in SCHEMES:
        raise ValueError(f"{text!r}: {scheme!r} is not a scheme; {suggestion(scheme, SCHEMES)}")
    parts = urlsplit(text.strip())
    options = _options(text, parts.query, (KEY, BAUD) if scheme == "serial" else (KEY,))
    key, baud = options.get(KEY, ""), options.get(BAUD, str(USUAL_BAUD))
    if scheme == "serial":
        if not parts.path:
            raise ValueError(f"{text!r} names no device, such as serial:///dev/ttyAMA0")
        if not (baud.isascii() and baud.isdecimal() and 0 < int(baud) <= FASTEST_BAUD):
            raise ValueError(f"{text!r}: {baud!r} is not a baud rate")
        return AutopilotAddress("serial", device=parts.path, baud=int(baud), key=key)
    try:
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if not host or not port or parts.path:
        raise ValueError(f"{text!r} is not {scheme}://HOST:PORT, with a port from 1 to 65535")
    return AutopilotAddress(scheme, host, port, key=key)


def _options(text: str, query: str, known: tuple[str, ...]) -> dict[str, str]:
    """The options after the question mark. Raises ValueError for an option that is not known, or has no value."""
    options = {name: values[-1] for name, values in parse_qs(query, keep_blank_values=True).items()}
    for name, value in options.items():
        if name not in known:
            raise ValueError(f"{text!r}: {name!r} is not an option; only {' and '.join(known)} are")
        if not value:
            raise ValueError(f"{text!r}: {name} has no value")
    return options


def open_device(task: Task, address: AutopilotAddress, receive: Callable[[bytes], object]) -> Device:
    """The device of a task at a place; `receive` takes what arrives."""
    if address.scheme == "serial":
        return task.serial(address.device, address.baud, frames=receive)
    if address.scheme == "tcpout":
        return task.tcp(address.host, address.port, frames=receive)
    if address.scheme == "udpout":
        own = "::" if ":" in address.host else "0.0.0.0"
        return task.udp(0, frames=receive, address=own, to=(address.host, address.port))
    return task.udp(address.port, frames=receive, address=address.host)

"""Links as written in a profile: SCHEME://ADDRESS[:PORT]?flavor=..&rates=..&key=.."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from ipaddress import ip_address

from imc.discovery import LOOPBACK, is_ip_address
from mavlink.modes import FLAVORS, Flavor
from support.terminal_text import with_suggestion

PORTS: Mapping[str, int] = {"udpin": 14550, "udpout": 14550, "udpbcast": 14550, "tcpin": 5760, "tcpout": 5760}
"""The schemes of networks, and their default ports."""

SERIAL = "serial"
SCHEMES = (*PORTS, SERIAL)
LISTENERS = ("udpin", "tcpin")
BAUD = 57600
LOW_SPEED = 200.0  # bytes/s that a link with low rates is taken for
CHOICES: Mapping[str, tuple[str, ...]] = {
    "flavor": tuple(FLAVORS),
    "rates": ("normal", "low"),
    "unsigned": ("drop", "accept"),
}
OPTIONS = (*CHOICES, "key", "baud")
OLD_FLAVOR = "flavour"  # deprecated
_FORM = re.compile(r"([a-z]+)://(\[[^\]]*\]|[^:?]*)(?::([^?]*))?(?:\?(.*))?", re.DOTALL)
_SERIAL = re.compile(r"serial://([^?]+)(?:\?(.*))?", re.DOTALL)
_NAME = re.compile(r"(?=.{1,253}$)[A-Za-z0-9_]([A-Za-z0-9_-]*[A-Za-z0-9_])?(\.[A-Za-z0-9_-]+)*\.?")
_BAUD = re.compile(r"[1-9][0-9]{1,7}")
_HEXADECIMAL = re.compile(r"[0-9a-fA-F]{64}")
_SECRET = re.compile(r"(\bkey=)[^&]*")


@dataclass(frozen=True, slots=True)
class LinkUrl:
    """One link in a profile.

    text: as it is shown, without options. host: an address or a name; the device of a serial line. port: 0 for a serial
    line. low: whether the default rates are those of slow links. key: the file with the key, empty for none. open:
    whether unsigned frames are accepted in spite of it. deprecation: a warning about an old option; empty if none.
    """

    text: str
    scheme: str
    host: str
    port: int
    flavor: Flavor
    low: bool = False
    key: str = ""
    accepts_unsigned: bool = False
    baud: int = BAUD
    deprecation: str = ""

    @property
    def listens(self) -> bool:
        """Whether the vehicle waits for ground stations."""
        return self.scheme in LISTENERS

    @property
    def address(self) -> tuple[str, int]:
        return self.host, self.port

    def at_port(self, port: int) -> "LinkUrl":
        """The link at another port of the same address."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return replace(self, port=port, text=f"{self.scheme}://{host}:{port}")

    @property
    def has_hostname(self) -> bool:
        """Whether the host is a name, which has to be looked up."""
        return self.scheme != SERIAL and not is_ip_address(self.host)

    @property
    def is_local(self) -> bool:
        """Whether only programs of this computer can use the link."""
        return self.scheme != SERIAL and not self.has_hostname and ip_address(self.host).is_loopback

    @property
    def requires_signing(self) -> bool:
        """Whether only messages of those who have the key are accepted."""
        return bool(self.key) and not self.accepts_unsigned

    @property
    def bytes_per_second(self) -> float:
        """Bytes per second that it carries."""
        line = self.baud / 10.0 if self.scheme == SERIAL else 1e6
        return min(line, LOW_SPEED) if self.low else line


def parse_link_url(text: str) -> LinkUrl:
    """Parses a link such as "udpin://127.0.0.1:14551?flavor=px4", or in the older form "udpin:127.0.0.1:14551:px4".

    Raises ValueError with the reason, in which no key is repeated.
    """
    text = text.strip()
    try:
        return _serial(text) or _older(text) or _network(text)
    except ValueError as error:
        raise ValueError(f"{_shown(text)}: {error}") from None


def _shown(text: str) -> str:
    return repr(_SECRET.sub(r"\1...", text))


def _serial(text: str) -> LinkUrl | None:
    found = _SERIAL.fullmatch(text)
    if found is None:
        return None
    return _route(text, SERIAL, found[1], 0, _options(found[2] or "", SERIAL))


def _older(text: str) -> LinkUrl | None:
    parts = text.split(":")
    if len(parts) != 4 or "//" in text or parts[0] not in ("udpin", "udpout"):
        return None
    scheme, host, port, flavor = parts
    if flavor not in FLAVORS:
        raise ValueError(with_suggestion(f"{flavor!r} is not a flavor", flavor, FLAVORS))
    return _route(text, scheme, _host(scheme, host), _port(port), {"flavor": flavor})


def _network(text: str) -> LinkUrl:
    found = _FORM.fullmatch(text)
    scheme = found[1] if found is not None else text.partition(":")[0]
    if scheme not in SCHEMES and (found is not None or ":" in text):
        raise ValueError(with_suggestion(f"{scheme!r} is not a scheme", scheme, SCHEMES))
    if found is None or scheme == SERIAL:
        example = "serial:///dev/ttyUSB0?baud=57600" if scheme == SERIAL else "udpin://127.0.0.1:14551?flavor=px4"
        raise ValueError(f"not SCHEME://ADDRESS[:PORT]?flavor=FLAVOR, such as {example}")
    host = _host(scheme, found[2])
    port = PORTS[scheme] if found[3] is None else _port(found[3])
    return _route(text, scheme, host, port, _options(found[4] or "", scheme))


def _route(text: str, scheme: str, host: str, port: int, options: Mapping[str, str]) -> LinkUrl:
    return LinkUrl(
        text.partition("?")[0],
        scheme,
        host,
        port,
        FLAVORS[options.get("flavor", "ardupilot")],
        low=options.get("rates") == "low",
        key=options.get("key", ""),
        accepts_unsigned=options.get("unsigned") == "accept",
        baud=int(options.get("baud", BAUD)),
        deprecation=options.get(OLD_FLAVOR, ""),
    )


def _host(scheme: str, text: str) -> str:
    host = text.removeprefix("[").removesuffix("]")
    if host == "localhost" or (not host and scheme in LISTENERS):
        return LOOPBACK
    if is_ip_address(host):
        if scheme == "udpbcast" and ip_address(host).version == 6:
            raise ValueError(f"{host!r}: IPv6 has no broadcast addresses")
        return host
    if scheme in LISTENERS or scheme == "udpbcast":
        raise ValueError(f"{host!r} is not an IPv4 address, or an IPv6 address in brackets")
    if "[" in text or not _NAME.fullmatch(host) or host.replace(".", "").isdecimal():
        raise ValueError(f"{host!r} is not an address or the name of a computer")
    return host


def _port(text: str) -> int:
    if not (text.isascii() and text.isdecimal() and 0 < int(text[:6]) < 65536):
        raise ValueError(f"{text!r} is not a port (1 to 65535)")
    return int(text)


def _options(text: str, scheme: str) -> dict[str, str]:
    found: dict[str, str] = {}
    for part in filter(None, text.split("&")):
        name, equals, value = part.partition("=")
        if name == OLD_FLAVOR:
            name, found[OLD_FLAVOR] = "flavor", f"{OLD_FLAVOR} is deprecated: write flavor"
        known = [option for option in OPTIONS if option != "baud" or scheme == SERIAL]
        if name not in known:
            raise ValueError(with_suggestion(f"{name!r} is not an option of this link", name, known))
        if name in found or not (equals and value):
            raise ValueError(f"{name!r} is given twice" if name in found else f"{name!r} has no value")
        if name in CHOICES and value not in CHOICES[name]:
            word = "a flavor" if name == "flavor" else f"a choice of {name!r}"
            raise ValueError(with_suggestion(f"{value!r} is not {word}", value, CHOICES[name]))
        found[name] = value
    if not _BAUD.fullmatch(found.get("baud", str(BAUD))):
        raise ValueError(f"{found['baud']!r} is not a baud rate")
    _check_key(found)
    return found


def _check_key(options: Mapping[str, str]) -> None:
    key = options.get("key", "")
    if _HEXADECIMAL.fullmatch(key):
        raise ValueError("'key' is the path of a file that holds the key, not the key: everybody can read a profile")
    if key and not key.startswith(("/", "~")):
        raise ValueError("'key' is not a whole path, such as /etc/shoal/mavlink.key")
    if "unsigned" in options and not key:
        raise ValueError("'unsigned' has no meaning without 'key'")

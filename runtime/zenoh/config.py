"""Configuration of a process that joins the bus through zenoh; by default only on the loopback interface."""

import json
import re
import socket
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast, get_args

from runtime.network_interfaces import is_loopback_host
from runtime.zenoh.loopback_discovery import LOOPBACK
from runtime.zenoh.security import ENCRYPTED, OPTIONS, Security, checks_identity

if TYPE_CHECKING:
    import zenoh

Mode = Literal["peer", "router", "client"]

LOCAL_PORT = 7447
SESSION_OFFSET = 53
SESSIONS = 32
LARGEST_MESSAGE = 64 << 20  # bytes that a sender can make us keep; zenoh allows 1 GB. The largest are frames of cameras
LEASE = 6000  # ms; a process that is silent for so long has gone
LONGEST_STALL = 250_000  # µs for which commands wait for a receiver that is 1 MB of them behind; then it is cut off
LONGEST_FRAME = 1_000_000  # µs until a frame that does not go through shared memory has been sent, else it is dropped

_ENDPOINT = re.compile(r"(?:tcp|udp|tls|quic|ws)/[^\s/?#]+:\d{1,5}(?:[?#]\S*)?")
_KEYWORDS = ("loopback", "none", "auto")
_LOOPBACKS = ("loopback", "lo", LOOPBACK)
_ADDRESS = re.compile(r"[\d.]+|[\da-fA-F]*:[\da-fA-F:.]*")
_GROUP_ADDRESS = "224.0.0.224:7446"
_ANY_PORT = re.compile(r":0(?:[?#]|$)")
_GROUP = re.compile(r"[\w.:\[\]]+:\d{1,5}")
_PLACE_IN_SOURCE = re.compile(r" at \S+\.rs:\d+\.?")


@dataclass(frozen=True, slots=True)
class SessionConfig:
    """The configuration of one session, and what belongs to it.

    role: "peer", "router" or "client".
    session: the endpoint where this session listens for others of the computer, "" for none.
    fixed: endpoints that the processes of the computer share, for a FailoverListener; they are not in `config`.
    group: multicast group and port that announces the session to the programs of this computer, "" for none.
    exposed: what others can reach without a certificate and access control.
    listen, connect: all endpoints, those of the computer included.
    """

    config: "zenoh.Config"
    role: str
    session: str
    fixed: list[str]
    group: str
    exposed: list[str]
    listen: list[str]
    connect: list[str]


@dataclass(frozen=True, slots=True)
class ZenohConfig:
    """Options of a process on the bus; None means the value of the configuration file, else the default in brackets.

    mode: "peer", "router" or "client" ["router" with endpoints or scouting beyond this computer, else "peer"].
    local_port: TCP port of 127.0.0.1 for clients; 0 disables it. The sessions of a computer listen at the first free
        ones of SESSIONS ports from SESSION_OFFSET after it, and each connects to all below its own.
    listen: further endpoints to listen at, such as "tls/0.0.0.0:7448" [none]. One process of a computer listens at the
        local port and at these; when it ends, another takes over.
    connect: further endpoints to connect and reconnect to [none].
    scouting: multicast discovery: "loopback", only programs of this computer; "none"; or the interfaces of zenoh's own
        scouting, "auto" for all ["loopback"].
    scouting_address: multicast group and port ["224.0.0.224:7446"].
    shared_memory: whether packets of 3 kB and more travel in shared memory, which takes 17 MB per process [False].
    config_file: a zenoh configuration (JSON5) for everything else, such as rates per link.
    hear: messages of other systems to receive, None for all; what is addressed to the vehicle it receives anyway [all].
    security: who may join, and what they may do there.
    vehicle: the name of the vehicle that commands are for ["*", any].
    """

    mode: Mode | None = None
    local_port: int = LOCAL_PORT
    listen: tuple[str, ...] | None = None
    connect: tuple[str, ...] | None = None
    scouting: str | None = None
    scouting_address: str | None = None
    shared_memory: bool | None = None
    config_file: Path | None = None
    hear: tuple[str, ...] | None = None
    security: Security = field(default_factory=Security)
    vehicle: str = "*"

    @classmethod
    def from_options(cls, options: Mapping[str, str], folder: Path = Path()) -> "ZenohConfig":
        """Read the options of a `[Zenoh]` section; `Config File` is relative to `folder`.

        Raises ValueError naming an option that is unknown or has an invalid value.
        """
        values: dict[str, Any] = {}
        secrets: dict[str, Any] = {}
        for name, text in options.items():
            if name not in _PARSERS:
                raise ValueError(f"[Zenoh] {name}: unknown option; known: {', '.join(_PARSERS)}")
            if not text.strip():
                continue
            try:
                value = _PARSERS[name](text.strip())
            except ValueError as error:
                raise ValueError(f"[Zenoh] {name}: {error}") from None
            found = secrets if name in OPTIONS else values
            found[name.lower().replace(" ", "_")] = folder / value if isinstance(value, Path) else value
        return cls(**values, security=Security(**secrets))

    def describe_missing_interface(self) -> str:
        """The fault of Scouting: an interface that this computer does not have; "" if nothing."""
        names = [] if self.scouting in (None, *_KEYWORDS) else (self.scouting or "").split(",")
        have = [name for _, name in socket.if_nameindex()]
        wrong = next((name for name in names if name not in have and not _ADDRESS.fullmatch(name)), "")
        return f"[Zenoh] Scouting: this computer has no interface {wrong!r}, only {', '.join(have)}" if wrong else ""

    def build(self, place: int = 0) -> SessionConfig:
        """The layout of a session that takes the session port number `place`.

        Raises ValueError for an invalid configuration file, and for options that contradict each other.
        """
        import zenoh

        pristine = zenoh.Config()
        try:
            config = zenoh.Config() if self.config_file is None else zenoh.Config.from_file(self.config_file)
        except zenoh.ZError as error:
            raise ValueError(f"{self.config_file}: {error_text(error)}") from None

        def get(name: str) -> Any:
            """The configured value, or None if it is zenoh's default."""
            value = json.loads(config.get_json(name))
            return None if value == json.loads(pristine.get_json(name)) else value

        def put(name: str, wanted: Any, default: Any) -> None:
            if wanted is not None or get(name) is None:
                set_option(config, name, default if wanted is None else wanted)

        scouting = self.scouting
        if scouting is None:
            in_file = get("scouting/multicast/interface") or "loopback"
            scouting = "none" if get("scouting/multicast/enabled") is False else in_file
        by_zenoh = scouting not in ("none", *_LOOPBACKS)
        # A peer passes nothing on between its own computer and others.
        ends = (*(self.listen or ()), *(self.connect or ()))
        put("mode", self.mode, "router" if by_zenoh or not all(map(is_loopback_endpoint, ends)) else "peer")
        mode = get("mode")
        listen = _list(self.listen, get("listen/endpoints"), mode)
        connect = _list(self.connect, get("connect/endpoints"), mode)
        beyond = [endpoint for endpoint in (*listen, *connect) if not is_loopback_endpoint(endpoint)]
        if by_zenoh and mode != "client" and all(map(is_loopback_endpoint, listen)):
            listen.append(
                f"{'tls' if self.security.certificate else 'tcp'}/0.0.0.0:0"
            )  # for sessions found by scouting
        session = ""
        if self.local_port and not (mode == "client" and connect):
            meeting_point = _here(self.local_port)
            ports = [_here(self.local_port + SESSION_OFFSET + number) for number in range(place + 1)]
            session = ports.pop() if mode != "client" else ""
            listen = [meeting_point, *listen]
            connect = [meeting_point, *(ports if mode != "client" else ()), *connect]
        fixed = [endpoint for endpoint in listen if session and not _ANY_PORT.search(endpoint)]
        others = [] if mode == "client" else [e for e in listen if e not in fixed]
        set_option(config, "listen/endpoints", [session, *others] if session else others)
        set_option(config, "connect/endpoints", connect)
        put("connect/retry", None, {"period_init_ms": 500, "period_max_ms": 1000, "period_increase_factor": 2})

        group = self.scouting_address or get("scouting/multicast/address") or _GROUP_ADDRESS
        set_option(config, "scouting/multicast/enabled", by_zenoh)
        set_option(config, "scouting/multicast/address", group)
        if by_zenoh:
            set_option(config, "scouting/multicast/interface", scouting)
            put("scouting/multicast/autoconnect", None, {role: ["router", "peer"] for role in ("router", "peer")})
        else:
            # Sessions of this computer are found at their ports; gossip would connect to all their other peers.
            put("scouting/gossip/autoconnect", None, [])

        # Frames are put into shared memory by camera_frames, packets by zenoh itself, from a pool of 17 MB.
        put("transport/shared_memory/enabled", None, True)
        put("transport/shared_memory/transport_optimization/enabled", self.shared_memory, False)
        put("transport/link/tx/lease", None, LEASE)
        put("transport/link/rx/max_message_size", None, LARGEST_MESSAGE)
        put("timestamping/enabled", None, True)  # zenoh keeps the last state of a publisher by its time
        for priority in ("real_time", "data"):
            put(f"transport/link/tx/queue/size/{priority}", None, 16)
        put("transport/link/tx/queue/congestion_control/block/wait_before_close", None, LONGEST_STALL)
        # A packet waits 0.2 ms for room; the pieces of a frame, which a thread of its own sends, longer and longer.
        for limit, longest in (("wait_before_drop", 200), ("max_wait_before_drop_fragments", LONGEST_FRAME)):
            put(f"transport/link/tx/queue/congestion_control/drop/{limit}", None, longest)
        try:
            self.security.apply(lambda name, value: set_option(config, name, value), self.vehicle)
        except zenoh.ZError as error:
            raise ValueError(f"[Zenoh]: {error_text(error)}") from None
        except ValueError as error:
            raise ValueError(f"[Zenoh] {error}") from None
        encrypted = set(get("transport/link/protocols") or ["tcp"]) <= {"tls", "quic"}
        open_to = [f"scouts on {scouting}"] if by_zenoh and not (encrypted and _is_guarded(get, mode, ())) else []
        return SessionConfig(
            config=config,
            role=mode,
            session=session,
            fixed=fixed,
            group=group if session and scouting != "none" else "",
            exposed=[*(beyond if not _is_guarded(get, mode, beyond) else ()), *open_to],
            listen=[*fixed, *others],
            connect=connect,
        )


def _here(port: int) -> str:
    return f"tcp/{LOOPBACK}:{port}"


def is_loopback_endpoint(endpoint: str) -> bool:
    """Whether an endpoint can only be reached from this computer."""
    protocol, _, rest = endpoint.partition("/")
    host = re.split(r"[?#]", rest)[0].rpartition(":")[0].strip("[]")
    return protocol.startswith("unix") or is_loopback_host(host)


def _is_guarded(get: Callable[[str], Any], mode: str, beyond: Iterable[str]) -> bool:
    """Whether all links beyond the computer are encrypted, and others get in only by name and access control."""
    return all(endpoint.startswith(ENCRYPTED) for endpoint in beyond) and (mode == "client" or checks_identity(get))


def error_text(error: Exception) -> str:
    """The text of an error of zenoh, without the places in zenoh's source."""
    return _PLACE_IN_SOURCE.sub("", str(error))


def set_option(config: "zenoh.Config", name: str, value: object) -> None:
    cast(Any, config).insert_json5(name, json.dumps(value))


def read_connect_endpoints(path: Path) -> list[str]:
    """The endpoints that a client with this configuration file connects to. Raises ValueError for an invalid file."""
    import zenoh

    try:
        text = zenoh.Config.from_file(path).get_json("connect/endpoints")
    except zenoh.ZError as error:
        raise ValueError(f"{path}: {error_text(error)}") from None
    return _list(None, json.loads(text), "client")


def _list(wanted: tuple[str, ...] | None, in_file: list[str] | dict[str, list[str]] | None, mode: str) -> list[str]:
    """The endpoints of the options, else those of the file, which may list them by mode."""
    if wanted is not None:
        return list(wanted)
    return (in_file.get(mode) if isinstance(in_file, dict) else in_file) or []


def _one_of(choices: Iterable[str]) -> Callable[[str], str]:
    words = tuple(choices)

    def parse(text: str) -> str:
        if text.lower() not in words:
            raise ValueError(f"{text!r} is not one of {', '.join(words)}")
        return text.lower()

    return parse


def _port(text: str) -> int:
    last = 65535 - SESSION_OFFSET - SESSIONS
    if not (text.isascii() and text.isdigit() and int(text) <= last):
        raise ValueError(f"{text!r} is not a port number from 0 to {last}")
    return int(text)


def _endpoints(text: str) -> tuple[str, ...]:
    endpoints = tuple(word.strip() for word in text.split(",") if word.strip())
    for endpoint in endpoints:
        if not _ENDPOINT.fullmatch(endpoint):
            raise ValueError(f"{endpoint!r} is not an endpoint such as tcp/192.168.1.1:7447")
    return endpoints


def _group(text: str) -> str:
    if not _GROUP.fullmatch(text):
        raise ValueError(f"{text!r} is not an address such as 224.0.0.224:7446")
    return text


def _interfaces(text: str) -> str:
    words = [word.strip() for word in text.split(",")]
    if not all(re.fullmatch(r"[\w.:@-]+", word) for word in words):
        raise ValueError(f"{text!r} is not loopback, none, auto or a list of interfaces")
    return ",".join(words) if len(words) > 1 or words[0].lower() not in _KEYWORDS else words[0].lower()


def _switch(text: str) -> bool:
    return _one_of(("true", "false"))(text) == "true"


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())


def _messages(text: str) -> tuple[str, ...] | None:
    names = _names(text)
    if "all" in names:
        return None
    for name in names:
        if not re.fullmatch(r"\w+", name):
            raise ValueError(f"{name!r} is not all, or a list of messages")
    return names


_KINDS: Mapping[str, Callable[[str], Any]] = {"file": Path, "switch": _switch, "name": str, "names": _names}
_PARSERS: Mapping[str, Callable[[str], Any]] = {
    "Mode": _one_of(get_args(Mode)),
    "Local Port": _port,
    "Listen": _endpoints,
    "Connect": _endpoints,
    "Scouting": _interfaces,
    "Scouting Address": _group,
    "Shared Memory": _switch,
    "Hear": _messages,
    "Config File": Path,
    **{name: _KINDS[kind] for name, kind in OPTIONS.items()},
}

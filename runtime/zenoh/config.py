"""How a process joins the bus through zenoh; by default only on the loopback interface."""

import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast, get_args

if TYPE_CHECKING:
    import zenoh

Mode = Literal["peer", "router", "client"]

LOCAL_PORT = 7447
LOOPBACK = "127.0.0.1"

_ENDPOINT = re.compile(r"(?:tcp|udp|tls|quic|ws)/[^\s/?#]+:\d{1,5}(?:[?#]\S*)?")
_KEYWORDS = ("loopback", "none", "auto")
_ANY_PORT = re.compile(r":0(?:[?#]|$)")
_GROUP = re.compile(r"[\w.:\[\]]+:\d{1,5}")
_PLACE_IN_SOURCE = re.compile(r" at \S+\.rs:\d+\.?")


@dataclass(frozen=True, slots=True)
class ZenohConfig:
    """How a process joins the bus; None means the value of the configuration file, else the default in brackets.

    mode: "peer", "router" or "client" ["peer"].
    local_port: TCP port of 127.0.0.1 where the processes of a computer meet; 0 disables it.
    listen: further endpoints to listen at, such as "tls/0.0.0.0:7448" [none]. One process of a computer listens at the
        local port and at these; when it ends, another takes over.
    connect: further endpoints to connect and reconnect to [none].
    scouting: where to find others by multicast: "loopback", "none", names of interfaces, or "auto" for all interfaces
        ["loopback"].
    scouting_address: multicast group and port ["224.0.0.224:7446"].
    shared_memory: whether packets of 3 kB and more travel in shared memory, which takes 17 MB per process [False].
    config_file: a zenoh configuration (JSON5) for everything else: TLS, access control, rates per link.
    """

    mode: Mode | None = None
    local_port: int = LOCAL_PORT
    listen: tuple[str, ...] | None = None
    connect: tuple[str, ...] | None = None
    scouting: str | None = None
    scouting_address: str | None = None
    shared_memory: bool | None = None
    config_file: Path | None = None

    @classmethod
    def from_options(cls, options: Mapping[str, str], folder: Path = Path()) -> "ZenohConfig":
        """Read the options of a `[Zenoh]` section; `Config File` is relative to `folder`.

        Raises ValueError naming an option that is unknown or has an invalid value.
        """
        values: dict[str, Any] = {}
        for name, text in options.items():
            if name not in _PARSERS:
                raise ValueError(f"[Zenoh] {name}: unknown option; known: {', '.join(_PARSERS)}")
            if not text.strip():
                continue
            try:
                value = _PARSERS[name](text.strip())
            except ValueError as error:
                raise ValueError(f"[Zenoh] {name}: {error}") from None
            values[name.lower().replace(" ", "_")] = folder / value if isinstance(value, Path) else value
        return cls(**values)

    def build(self) -> tuple["zenoh.Config", list[str]]:
        """The zenoh configuration without its endpoints at fixed ports, and these endpoints, for a MeetingPoint.

        Raises ValueError for an invalid configuration file.
        """
        import zenoh

        pristine = zenoh.Config()
        try:
            config = zenoh.Config() if self.config_file is None else zenoh.Config.from_file(self.config_file)
        except zenoh.ZError as error:
            raise ValueError(f"{self.config_file}: {explain(error)}") from None

        def get(name: str) -> Any:
            """The configured value, or None if it is zenoh's default."""
            value = json.loads(config.get_json(name))
            return None if value == json.loads(pristine.get_json(name)) else value

        def put(name: str, wanted: Any, default: Any) -> None:
            if wanted is not None or get(name) is None:
                insert(config, name, default if wanted is None else wanted)

        put("mode", self.mode, "peer")
        mode = get("mode")
        listen = _list(self.listen, get("listen/endpoints"), mode)
        connect = _list(self.connect, get("connect/endpoints"), mode)
        if self.local_port and not (mode == "client" and connect):
            meeting_point = f"tcp/{LOOPBACK}:{self.local_port}"
            listen = [f"tcp/{LOOPBACK}:0", meeting_point, *listen]
            connect = [meeting_point, *connect]
        fixed = [] if mode == "client" else [endpoint for endpoint in listen if not _ANY_PORT.search(endpoint)]
        insert(config, "listen/endpoints", [] if mode == "client" else [e for e in listen if e not in fixed])
        insert(config, "connect/endpoints", connect)
        put("connect/retry", None, {"period_init_ms": 500, "period_max_ms": 1000, "period_increase_factor": 2})

        interface = LOOPBACK if self.scouting == "loopback" else None if self.scouting == "none" else self.scouting
        put("scouting/multicast/enabled", None if self.scouting is None else self.scouting != "none", True)
        put("scouting/multicast/interface", interface, LOOPBACK)
        put("scouting/multicast/address", self.scouting_address, "224.0.0.224:7446")
        if get("scouting/multicast/interface") == LOOPBACK and get("scouting/multicast/enabled"):
            # Scouting finds all processes of this computer; gossip would also connect to the peers they know elsewhere.
            put("scouting/gossip/autoconnect", None, [])

        put("transport/shared_memory/enabled", self.shared_memory, False)
        put("transport/link/tx/queue/size/data", None, 16)
        for limit in ("wait_before_drop", "max_wait_before_drop_fragments"):
            put(f"transport/link/tx/queue/congestion_control/drop/{limit}", None, 200)  # µs
        return config, fixed


def explain(error: Exception) -> str:
    """The text of an error of zenoh, without the places in zenoh's source."""
    return _PLACE_IN_SOURCE.sub("", str(error))


def insert(config: "zenoh.Config", name: str, value: object) -> None:
    cast(Any, config).insert_json5(name, json.dumps(value))


def _list(wanted: tuple[str, ...] | None, in_file: list[str] | dict[str, list[str]] | None, mode: str) -> list[str]:
    """The wanted endpoints, else those of the file, which may list them by mode."""
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
    if not (text.isascii() and text.isdigit() and int(text) < 65536):
        raise ValueError(f"{text!r} is not a port number")
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


_PARSERS: Mapping[str, Callable[[str], Any]] = {
    "Mode": _one_of(get_args(Mode)),
    "Local Port": _port,
    "Listen": _endpoints,
    "Connect": _endpoints,
    "Scouting": _interfaces,
    "Scouting Address": _group,
    "Shared Memory": lambda text: _one_of(("true", "false"))(text) == "true",
    "Config File": Path,
}

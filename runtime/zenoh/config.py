"""How a process joins the bus through zenoh: on the loopback interface, unless more is asked for."""

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
    """How a process joins the bus; None is what the configuration file says, and else the default in brackets.

    mode: "peer", "router" or "client" ["peer"].
    local_port: TCP port of 127.0.0.1 where the processes of a computer meet; 0 is none.
    listen: further endpoints to be reached at, such as "tls/0.0.0.0:7448" [none]. Of the processes of a computer one
        listens at the local port and at these; when it goes, another takes over.
    connect: further endpoints to keep connecting to [none].
    scouting: "loopback", "none", or the interfaces to find others on by multicast, "auto" for all ["loopback"].
    scouting_address: multicast group and port ["224.0.0.224:7446"].
    shared_memory: whether packets of 3 kB and more travel in shared memory, which takes 17 MB per process [False].
    config_file: a zenoh configuration (JSON5) for all the rest: TLS, access control, rates per link.
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

        Raises ValueError naming the option that is unknown or has a value it cannot have.
        """
        values: dict[str, Any] = {}
        for name, text in options.items():
            if name not in _PARSERS:
                raise ValueError(f"[Zenoh] {name}: no such option; there are {', '.join(_PARSERS)}")
            if not text.strip():
                continue
            try:
                value = _PARSERS[name](text.strip())
            except ValueError as error:
                raise ValueError(f"[Zenoh] {name}: {error}") from None
            values[name.lower().replace(" ", "_")] = folder / value if isinstance(value, Path) else value
        return cls(**values)

    def build(self) -> tuple["zenoh.Config", list[str]]:
        """The zenoh configuration, which listens at no fixed port, and the endpoints that are left out for that.

        Raises ValueError where the configuration file is not one.
        """
        import zenoh

        pristine = zenoh.Config()
        try:
            config = zenoh.Config() if self.config_file is None else zenoh.Config.from_file(self.config_file)
        except zenoh.ZError as error:
            raise ValueError(f"{self.config_file}: {explain(error)}") from None

        def get(name: str) -> Any:
            """What the file says, None where it is silent."""
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
            # Scouting finds everybody on this computer; gossip would go on to the peers that those know elsewhere.
            put("scouting/gossip/autoconnect", None, [])

        put("transport/shared_memory/enabled", self.shared_memory, False)
        put("transport/link/tx/queue/size/data", None, 16)
        for limit in ("wait_before_drop", "max_wait_before_drop_fragments"):
            put(f"transport/link/tx/queue/congestion_control/drop/{limit}", None, 200)  # µs
        return config, fixed


def explain(error: Exception) -> str:
    """What zenoh says, without the places in its source."""
    return _PLACE_IN_SOURCE.sub("", str(error))


def insert(config: "zenoh.Config", name: str, value: object) -> None:
    cast(Any, config).insert_json5(name, json.dumps(value))


def _list(wanted: tuple[str, ...] | None, in_file: list[str] | dict[str, list[str]] | None, mode: str) -> list[str]:
    """Endpoints: those that are wanted, else those of the file, which may have them by mode."""
    if wanted is not None:
        return list(wanted)
    return (in_file.get(mode) if isinstance(in_file, dict) else in_file) or []


def _one_of(choices: Iterable[str]) -> Callable[[str], str]:
    words = tuple(choices)

    def parse(text: str) -> str:
        if text.lower() not in words:
            raise ValueError(f"{text!r} is none of {', '.join(words)}")
        return text.lower()

    return parse


def _port(text: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text) < 65536):
        raise ValueError(f"{text!r} is no port number")
    return int(text)


def _endpoints(text: str) -> tuple[str, ...]:
    endpoints = tuple(word.strip() for word in text.split(",") if word.strip())
    for endpoint in endpoints:
        if not _ENDPOINT.fullmatch(endpoint):
            raise ValueError(f"{endpoint!r} is no endpoint such as tcp/192.168.1.1:7447")
    return endpoints


def _group(text: str) -> str:
    if not _GROUP.fullmatch(text):
        raise ValueError(f"{text!r} is no address such as 224.0.0.224:7446")
    return text


def _interfaces(text: str) -> str:
    words = [word.strip() for word in text.split(",")]
    if not all(re.fullmatch(r"[\w.:@-]+", word) for word in words):
        raise ValueError(f"{text!r} is neither loopback, none, auto nor a list of interfaces")
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

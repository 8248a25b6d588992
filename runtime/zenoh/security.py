"""Security of a zenoh bus, who may join and do what: certificates, passwords and access control of zenoh.

A program with a proven name, by a certificate (its common name) or a password, may do what its list allows; all others
nothing. The lists are for those beyond the computer: its own programs, if they can log in, may do everything.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from runtime.zenoh.certificate_checks import certificate_problem, is_world_accessible
from runtime.zenoh.key_expressions import ALL_SYSTEMS, HEARD, PREFIX, key_chunk

ENCRYPTED = ("tls/", "quic/")
LOOPBACK_INTERFACES = ["lo", "lo0"]
SENDING = ("put", "delete", "reply", "declare_queryable", "liveliness_token")
ASKING = ("query", "declare_subscriber", "liveliness_query", "declare_liveliness_subscriber")
PUBLIC = [f"{PREFIX}/**", f"{PREFIX}/*/@alive/**", f"{PREFIX}/*/@run/**", f"{PREFIX}/**/@adv/**"]
LAST = f"{PREFIX}/*/@q/*/*"  # the last message of an entity; a request, which may be a command, has one chunk less
EVERYTHING = [*PUBLIC, *(f"{PREFIX}/*/{verb}/**" for verb in ("@cmd", "@q", "@frame", HEARD))]
OF_CONSOLES = [f"{PREFIX}/*/{message}/*" for message in ("Abort", "Announce", "Heartbeat")]

Rule = dict[str, Any]
Put = Callable[[str, Any], None]


@dataclass(frozen=True, slots=True)
class Security:
    """Certificates, passwords, and lists of names; nothing set means that anybody who reaches a socket may everything.

    root_certificate: PEM file of the authority that has signed the certificates of all; with it, all must have one,
        unless mutual_tls is False.
    certificate, private_key: PEM files of this process.
    user, password_file: by which this process logs in at others; the password is the content of the file.
    users_file: who may log in here, a line `user:password` for each.
    commanders: names that may send commands to the vehicle, ask it, and receive everything.
    listeners: names that may only receive.
    vehicles: names of other vehicles: may publish in their own name, and receive everything. The name of this one
        stands for its processes on other computers, which may do everything.
    """

    root_certificate: Path | None = None
    certificate: Path | None = None
    private_key: Path | None = None
    mutual_tls: bool | None = None
    user: str | None = None
    password_file: Path | None = None
    users_file: Path | None = None
    commanders: tuple[str, ...] | None = None
    listeners: tuple[str, ...] | None = None
    vehicles: tuple[str, ...] | None = None

    def apply(self, put: Put, vehicle: str) -> None:
        """Set the options in a zenoh configuration. Raises ValueError naming the option that cannot work."""
        self._certify(put)
        self._log_in(put)
        lists = (self.commanders, self.listeners, self.vehicles)
        if any(names is not None for names in lists):
            if self.users_file is None and self.root_certificate is None:
                raise ValueError("Commanders, Listeners and Vehicles need Root Certificate or Users File")
            named = [name for names in lists for name in names or ()]
            if twice := next((name for name in named if named.count(name) > 1), ""):
                raise ValueError(f"{twice} is listed twice in Commanders, Listeners and Vehicles")
            put("access_control", self._access(vehicle))

    def warnings(self, listen: Iterable[str], connect: Iterable[str]) -> list[str]:
        """Warnings about faults that are likely at these endpoints, and about keys that others can read."""
        found: list[str] = []
        root, own, key = self.root_certificate, self.certificate, self.private_key
        if root and own and key:
            serves, asks = (any(e.startswith(ENCRYPTED) for e in ends) for ends in (listen, connect))
            of_server = certificate_problem(root, own, key) if serves else ""
            of_client = (
                certificate_problem(root, own, key, of_client=True) if asks and self.mutual_tls is not False else ""
            )
            for who, why in (("who connect here", of_server), ("whom it connects to", of_client)):
                if why:
                    found.append(f"Certificate: those {who} will not accept {own}: {why}")
        secrets = {"Private Key": self.private_key, "Password File": self.password_file, "Users File": self.users_file}
        for option, path in secrets.items():
            if path is not None and is_world_accessible(path):
                found.append(f"{option}: every user of this computer can read or change {path}; chmod o-rw {path}")
        return found

    def _certify(self, put: Put) -> None:
        tls = "transport/link/tls"
        if self.root_certificate is not None:
            put(f"{tls}/root_ca_certificate", _readable("Root Certificate", self.root_certificate))
            put(f"{tls}/enable_mtls", self.mutual_tls is not False)
        elif self.mutual_tls:
            raise ValueError("Mutual TLS needs Root Certificate, the authority of those who connect")
        if (self.certificate is None) != (self.private_key is None):
            raise ValueError("Certificate and Private Key belong together")
        if self.certificate is not None and self.private_key is not None:
            for end in ("listen", "connect"):
                put(f"{tls}/{end}_certificate", _readable("Certificate", self.certificate))
                put(f"{tls}/{end}_private_key", _readable("Private Key", self.private_key))

    def _log_in(self, put: Put) -> None:
        if (self.user is None) != (self.password_file is None):
            raise ValueError("User and Password File belong together")
        if self.users_file is not None and self.user is None:
            raise ValueError("Users File needs User and Password File, too: processes log in at each other")
        if self.user is not None and self.password_file is not None:
            put("transport/auth/usrpwd/user", self.user)
            put("transport/auth/usrpwd/password", _first_line("Password File", self.password_file))
        if self.users_file is not None:
            put("transport/auth/usrpwd/dictionary_file", _readable("Users File", self.users_file))

    def _access(self, vehicle: str) -> dict[str, Any]:
        own = f"{PREFIX}/{vehicle if vehicle == '*' else key_chunk(vehicle)}"
        commands = [f"{own}/@cmd/**", f"{PREFIX}/{ALL_SYSTEMS}/@cmd/**"]
        rules: list[Rule] = [
            _rule("all", (*SENDING, *ASKING), EVERYTHING),
            _rule("receive", SENDING, [*PUBLIC, LAST], "egress"),
            _rule("ask", ASKING, [*PUBLIC, LAST], "ingress"),
            _rule("take commands", ("declare_subscriber",), EVERYTHING, "egress"),
            _rule("command", ("put",), [*commands, *OF_CONSOLES], "ingress"),
            _rule("request", ("query",), [f"{own}/@q/**"], "ingress"),
            _rule("answer", ("put", "reply", "declare_queryable"), [f"{PREFIX}/*/@cmd/**", f"{own}/@q/**"], "egress"),
            _rule("take answers", ("declare_subscriber",), [f"{PREFIX}/*/@cmd/**"], "ingress"),
            _rule("be alive", ("liveliness_token",), [f"{PREFIX}/*/@alive/**"], "ingress"),
            _rule("be the vehicle", SENDING, [f"{own}/**", f"{own}/@alive/**", f"{own}/@run/**"], "ingress", "deny"),
        ]
        here: dict[str, Any] = {"id": "here", "interfaces": LOOPBACK_INTERFACES, "link_protocols": ["tcp"]}
        subjects: list[dict[str, Any]] = [here]
        policies: list[dict[str, Any]] = [{"subjects": ["here"], "rules": ["all"]}]

        def allow(name: str, *granted: str) -> None:
            known = {"usernames": [name]} if self.users_file is not None else {"cert_common_names": [name]}
            subjects.append({"id": name, **known})
            policies.append({"subjects": [name], "rules": ["receive", "ask", *granted]})

        for name in self.commanders or ():
            allow(name, "take commands", "command", "request", "answer", "take answers", "be alive", "be the vehicle")
        for name in self.listeners or ():
            allow(name)
        for name in self.vehicles or ():
            if name == vehicle:  # another process of it, on another computer
                allow(name, "all")
                continue
            theirs = f"{PREFIX}/{key_chunk(name)}"
            places = [f"{theirs}/{rest}" for rest in ("**", "@alive/**", "@run/**", "**/@adv/**")]
            rules.append(_rule(f"of {name}", SENDING, places, "ingress"))
            allow(name, "take commands", f"of {name}")
        return {
            "enabled": True,
            "default_permission": "deny",
            "rules": rules,
            "subjects": subjects,
            "policies": policies,
        }


def _rule(name: str, kinds: tuple[str, ...], keys: list[str], flow: str = "", permission: str = "allow") -> Rule:
    flows = [flow] if flow else ["ingress", "egress"]
    return {"id": name, "permission": permission, "messages": list(kinds), "flows": flows, "key_exprs": keys}


def _readable(option: str, path: Path) -> str:
    try:
        with path.open("rb"):
            return str(path)
    except OSError as error:
        raise ValueError(f"{option}: {path}: {error.strerror}") from None


def _first_line(option: str, path: Path) -> str:
    _readable(option, path)
    lines = path.read_text(errors="replace").splitlines()
    if not lines or not lines[0]:
        raise ValueError(f"{option}: {path} has no password in its first line")
    return lines[0]


def checks_identity(get: Callable[[str], Any]) -> bool:
    """Whether only those are admitted who prove their name, within access control."""
    proves = get("transport/link/tls/enable_mtls") is True or bool(get("transport/auth/usrpwd/dictionary_file"))
    return proves and get("access_control/enabled") is True


OPTIONS: Mapping[str, str] = {
    "Root Certificate": "file",
    "Certificate": "file",
    "Private Key": "file",
    "Mutual TLS": "switch",
    "User": "name",
    "Password File": "file",
    "Users File": "file",
    "Commanders": "names",
    "Listeners": "names",
    "Vehicles": "names",
}
"""The options of [Zenoh] for the fields of Security, by kind of value."""

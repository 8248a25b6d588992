"""The users of the page: names, roles, and passwords, of which a file has scrypt hashes only."""

import base64
import hashlib
import hmac
import os
import re
import secrets
import stat
from dataclasses import dataclass, replace
from enum import IntEnum
from pathlib import Path
from typing import Self

from support.atomic_files import write_file
from support.regular_files import read_regular_file
from support.terminal_text import quoted

COST, BLOCK, PARALLEL = 1 << 14, 8, 1  # of scrypt: 16 MiB and about 50 ms
MOST_COST = 1 << 16
SALT, HASH = 16, 64  # bytes
SHORTEST_PASSWORD, LONGEST_PASSWORD = 8, 256
MOST_USERS = 256
MOST_CERTIFICATES = 8  # of a user
CERTIFICATE = re.compile(r"certificate\$([0-9a-f]{64})")
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,31}")
PRIVATE = 0o600
FILE = "users.txt"


class Role(IntEnum):
    """Rights of a user; each role includes those before it."""

    WATCH = 0
    """See everything."""
    OPERATE = 1
    """Abort, hold, surface, and store, start, stop and delete plans."""
    MAINTAIN = 2
    """Set parameters."""

    @property
    def word(self) -> str:
        return self.name.lower()


class UsersError(ValueError):
    """A file of users that cannot be used, or a user that cannot be added; the text is for people."""


@dataclass(frozen=True)
class User:
    """User who has logged in."""

    name: str
    role: Role


LOCAL = User("local", Role.MAINTAIN)
"""The user who has opened a printed link."""


@dataclass(frozen=True)
class _Entry:
    role: Role
    cost: int
    salt: bytes
    hash: bytes
    certificates: tuple[str, ...] = ()

    @classmethod
    def of_password(cls, role: Role, password: str) -> Self:
        salt = secrets.token_bytes(SALT)
        return cls(role, COST, salt, _scrypt(password, salt, COST))

    @classmethod
    def of_nobody(cls) -> Self:
        """One that no password matches, made without scrypt: the task that serves the page may try again for ever."""
        return cls(Role.WATCH, COST, secrets.token_bytes(SALT), secrets.token_bytes(HASH))

    @classmethod
    def parse(cls, role: str, text: str) -> Self:
        """Raises ValueError."""
        password, *others = text.split(":")
        kind, cost, salt, found = password.split("$")
        if kind != "scrypt" or not 2 <= int(cost) <= MOST_COST or int(cost).bit_count() != 1:
            raise ValueError
        certificates = tuple(match[1] for match in map(CERTIFICATE.fullmatch, others) if match is not None)
        if len(certificates) != len(others):
            raise ValueError
        return cls(Role[role.upper()], int(cost), base64.b64decode(salt), base64.b64decode(found), certificates)

    def __str__(self) -> str:
        parts = (base64.b64encode(each).decode() for each in (self.salt, self.hash))
        others = "".join(f":certificate${each}" for each in self.certificates)
        return f"{self.role.word}:scrypt${self.cost}${'$'.join(parts)}{others}"

    def matches(self, password: str) -> bool:
        return hmac.compare_digest(_scrypt(password, self.salt, self.cost), self.hash)


class Users:
    """The users in the file users.txt of a folder, which is read again when it changes; without it there are none.

    Each line is NAME:ROLE:scrypt$COST$SALT$HASH, with :certificate$SHA256 for each client certificate. Raises
    UsersError if others than its owner can read the file, or a line is damaged, at the start. Later the users are then
    none, and `trouble` says why, until the file is repaired.
    """

    def __init__(self, folder: Path) -> None:
        self.path: Path = folder / FILE
        self.trouble: str = ""
        self._known: tuple[int, int, int] | None = None
        self._entries: dict[str, _Entry] = {}
        self._nobody = _Entry.of_nobody()
        self._read()

    def __bool__(self) -> bool:
        self._refresh()
        return bool(self._entries)

    def find(self, name: str) -> User | None:
        """The user of a name, with the role that it has now."""
        self._refresh()
        entry = self._entries.get(name)
        return None if entry is None else User(name, entry.role)

    def password_mark(self, name: str) -> bytes:
        """Bytes that change with the password of a user; empty if there is none. They are a secret."""
        self._refresh()
        entry = self._entries.get(name)
        return b"" if entry is None else entry.hash

    def check(self, name: str, password: str) -> User | None:
        """The user of a name and password. Takes about 50 ms, also for a name that does not exist."""
        self._refresh()
        entry = self._entries.get(name)
        is_right = (entry or self._nobody).matches(password[:LONGEST_PASSWORD])
        return User(name, entry.role) if entry is not None and is_right else None

    def add(self, name: str, role: Role, password: str) -> None:
        """Add a user, or replace one, in the file; a new password ends its sessions. Raises UsersError, OSError."""
        self.check_name(name)
        if not SHORTEST_PASSWORD <= len(password) <= LONGEST_PASSWORD:
            raise UsersError(f"a password has {SHORTEST_PASSWORD} to {LONGEST_PASSWORD} characters")
        known = self._entries.get(name)
        is_same = known is not None and known.matches(password)
        entry = replace(known, role=role) if known is not None and is_same else _Entry.of_password(role, password)
        if known is not None:
            entry = replace(entry, certificates=known.certificates)
        self._write(self._entries | {name: entry})

    def add_certificate(self, name: str, role: Role, sha256: str) -> None:
        """Let a client certificate, by the hexadecimal digits of its SHA-256, log in a user, who is added if needed.

        Raises UsersError, OSError.
        """
        self.check_name(name)
        entry = self._entries.get(name) or _Entry.of_nobody()
        certificates = *entry.certificates, sha256
        if len(certificates) > MOST_CERTIFICATES:
            raise UsersError(f"{name} has {MOST_CERTIFICATES} certificates: remove the user, and make new ones")
        self._write(self._entries | {name: replace(entry, role=role, certificates=certificates)})

    def certificate_user(self, sha256: str) -> User | None:
        """The user of a client certificate."""
        self._refresh()
        found = (name for name, entry in self._entries.items() if sha256 in entry.certificates)
        return next((User(name, self._entries[name].role) for name in found), None)

    def remove(self, name: str) -> None:
        """Remove a user from the file; its sessions end. Raises UsersError if there is none, OSError."""
        if name not in self._entries:
            raise UsersError(f"there is no user {quoted(name)} in {self.path}")
        self._write({other: entry for other, entry in self._entries.items() if other != name})

    def roles(self) -> dict[str, Role]:
        """The users by name."""
        self._refresh()
        return {name: entry.role for name, entry in self._entries.items()}

    @staticmethod
    def check_name(name: str) -> None:
        """Raises UsersError for a name that no user can have."""
        if not NAME.fullmatch(name) or name == LOCAL.name:
            raise UsersError(f"{quoted(name)} cannot be the name of a user: up to 32 letters, digits, '.', '_' or '-'")

    def _write(self, entries: dict[str, _Entry]) -> None:
        if len(entries) > MOST_USERS:
            raise UsersError(f"there are at most {MOST_USERS} users")
        text = "".join(f"{name}:{entry}\n" for name, entry in sorted(entries.items()))
        write_file(self.path, text.encode(), PRIVATE)
        self._read()

    def _refresh(self) -> None:
        try:
            self._read()
        except (UsersError, OSError) as error:
            self._entries, self.trouble = {}, str(error)

    def _read(self) -> None:
        try:
            found = os.stat(self.path)
        except FileNotFoundError:
            self._known, self._entries, self.trouble = None, {}, ""
            return
        if (version := (found.st_mtime_ns, found.st_ino, found.st_size)) == self._known:
            return
        self._known = None
        if stat.S_IMODE(found.st_mode) & 0o077:
            raise UsersError(f"{self.path}: others can read or change this file: chmod 600 {self.path}")
        lines = read_regular_file(self.path).decode(errors="replace").splitlines()
        self._entries = dict(self._parse_line(number, line) for number, line in enumerate(lines, 1) if line.strip())
        self._known, self.trouble = version, ""

    def _parse_line(self, number: int, line: str) -> tuple[str, _Entry]:
        name, _, rest = line.partition(":")
        role, _, text = rest.partition(":")
        try:
            if not NAME.fullmatch(name) or name == LOCAL.name:
                raise ValueError
            return name, _Entry.parse(role, text)
        except (ValueError, KeyError):
            raise UsersError(f"{self.path}:{number}: not NAME:ROLE:scrypt$COST$SALT$HASH") from None


def _scrypt(password: str, salt: bytes, cost: int) -> bytes:
    data = password.encode(errors="surrogatepass")
    return hashlib.scrypt(data, salt=salt, n=cost, r=BLOCK, p=PARALLEL, maxmem=256 * cost * BLOCK)

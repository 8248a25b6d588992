"""Access to the page: one-time links, users with passwords, and the sessions that they open."""

import asyncio
import hmac
import math
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from shoal.console.access.users import LOCAL, User, Users
from support.token_bucket import TokenBuckets

LINK_LIFETIME = 600.0  # s from the print of a link to its first use
SESSION_LIFETIME = 12 * 3600.0  # s without a request
MOST_SESSIONS = 64
LOGINS = 5  # a minute, from one address
MOST_ADDRESSES = 256


class LoginError(Exception):
    """A login that is rejected; the text is for the user."""


class ShownCertificate(NamedTuple):
    """The certificate that a client has shown: its SHA-256 in hexadecimal digits, and its end (s since 1970 UTC)."""

    sha256: str = ""
    end: float = -math.inf


NO_CERTIFICATE = ShownCertificate()


@dataclass(frozen=True)
class PageSession:
    """Session of a user; the number is no secret."""

    number: int
    user: User


@dataclass
class _OpenSession:
    number: int
    user: User
    used: float
    password_mark: bytes
    certificate: ShownCertificate


class Access:
    """Links that each log in once, users, and sessions by their secret, which only a cookie carries.

    A wrong or used link, or a wrong password, counts against the limit of logins from an address; a session without a
    request for 12 hours ends, and so does that of a user who is removed or gets another password, and with the
    certificate that has opened it. `clock` returns seconds, `date` those since 1970 UTC.
    """

    def __init__(
        self,
        clock: Callable[[], float] = time.monotonic,
        users: Users | None = None,
        date: Callable[[], float] = time.time,
    ) -> None:
        self._clock, self._users, self._date = clock, users, date
        self._links: dict[str, float] = {}
        self._sessions: dict[str, _OpenSession] = {}
        self._logins = TokenBuckets(LOGINS / 60.0, LOGINS, MOST_ADDRESSES)
        self._number = 0
        self._checking = asyncio.Lock()  # one scrypt at a time: it takes a core and 16 MiB

    @property
    def has_users(self) -> bool:
        """Whether anybody can log in with a password."""
        return bool(self._users)

    def make_link_token(self) -> str:
        """The secret of a new link."""
        token = secrets.token_urlsafe(24)
        self._links[token] = self._clock() + LINK_LIFETIME
        return token

    def login(self, token: object, address: str = "") -> str:
        """The secret of a new session for the token of a link, which is used up. Raises LoginError."""
        now = self._count_login(address)
        self._links = {each: end for each, end in self._links.items() if end > now}
        given = token if isinstance(token, str) else ""
        found = next(
            (each for each in self._links if hmac.compare_digest(each.encode(), given.encode(errors="replace"))), None
        )
        if found is None:
            raise LoginError(
                "this link has been used, or is older than ten minutes: start `shoal console` again, or "
                "log in as a user that `shoal console user` has made, also while a vehicle runs"
            )
        del self._links[found]
        return self._open(LOCAL)

    async def login_user(self, name: object, password: object, address: str = "") -> str:
        """The secret of a new session for a name and a password. Raises LoginError."""
        self._count_login(address)
        user = None
        if self._users is not None and isinstance(name, str) and isinstance(password, str):
            async with self._checking:
                user = await asyncio.to_thread(self._users.check, name, password)
        if user is None:
            self._check_users()
            raise LoginError("wrong name or password")
        return self._open(user)

    def login_certificate(self, shown: ShownCertificate, address: str = "") -> str:
        """The secret of a new session for a client certificate that TLS has checked. Raises LoginError."""
        self._count_login(address)
        user = self.certificate_user(shown)
        if user is None:
            self._check_users()
            raise LoginError("the browser has shown no certificate of a user")
        return self._open(user, shown)

    def certificate_user(self, shown: ShownCertificate) -> User | None:
        """The user of a client certificate; without one, or after its end, there is none."""
        if self._users is None or not shown.sha256 or self._date() > shown.end:
            return None
        return self._users.certificate_user(shown.sha256)

    def logout(self, secret: str | None) -> None:
        """End a session."""
        self._sessions.pop(secret or "", None)

    def session(self, secret: str | None) -> PageSession | None:
        """The session of a cookie, whose time begins anew."""
        now, found = self._clock(), self._sessions.get(secret or "")
        if found is None or secret is None:
            return None
        user = self._present_user(found)
        if user is None and self._users is not None and self._users.trouble:
            return None  # until the file of users is repaired
        if user is None or now - found.used > SESSION_LIFETIME:
            del self._sessions[secret]
            return None
        found.used, found.user = now, user
        return PageSession(found.number, user)

    def is_logged_in(self, secret: str | None) -> bool:
        """Whether a cookie is that of a session, whose time begins anew."""
        return self.session(secret) is not None

    def _count_login(self, address: str) -> float:
        now = self._clock()
        if not self._logins[address].try_acquire(now):
            raise LoginError(f"more than {LOGINS} logins within a minute: wait a minute")
        return now

    def _present_user(self, session: _OpenSession) -> User | None:
        """The user of a session as the file has it now; None if the session may not continue."""
        if session.user is LOCAL or self._users is None:
            return session.user
        user = self._users.find(session.user.name)
        if user is None:
            return None
        if session.certificate.sha256:
            return user if self.certificate_user(session.certificate) == user else None
        return user if self._password_mark(user) == session.password_mark else None

    def _check_users(self) -> None:
        """Raises LoginError if the file of users is damaged, so that nobody can log in."""
        if self._users is not None and self._users.trouble:
            raise LoginError("the file of users is damaged: only a link logs in until it is repaired")

    def _open(self, user: User, certificate: ShownCertificate = NO_CERTIFICATE) -> str:
        secret = secrets.token_urlsafe(32)
        while len(self._sessions) >= MOST_SESSIONS:
            del self._sessions[min(self._sessions, key=lambda each: self._sessions[each].used)]
        self._number += 1
        self._sessions[secret] = _OpenSession(self._number, user, self._clock(), self._password_mark(user), certificate)
        return secret

    def _password_mark(self, user: User) -> bytes:
        return b"" if user is LOCAL or self._users is None else self._users.password_mark(user.name)

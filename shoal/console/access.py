"""Access to the page: one-time links, and the sessions that they open."""

import hmac
import secrets
import time
from collections.abc import Callable

from support.token_bucket import TokenBucket

LINK_LIFETIME = 600.0  # s from the print of a link to its first use
SESSION_LIFETIME = 12 * 3600.0  # s without a request
MOST_SESSIONS = 64
LOGINS = 5  # a minute


class LoginError(Exception):
    """A login that is rejected; the text is for the user."""


class Access:
    """Links that each log in once, and sessions by their secret, which only a cookie carries.

    A wrong or used link counts against the limit of logins; a session without a request for 12 hours ends. `clock`
    returns seconds.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._links: dict[str, float] = {}
        self._sessions: dict[str, float] = {}
        self._logins = TokenBucket(LOGINS / 60.0, LOGINS)

    def make_link_token(self) -> str:
        """The secret of a new link."""
        token = secrets.token_urlsafe(24)
        self._links[token] = self._clock() + LINK_LIFETIME
        return token

    def login(self, token: object) -> str:
        """The secret of a new session for the token of a link, which is used up. Raises LoginError."""
        now = self._clock()
        if not self._logins.try_acquire(now):
            raise LoginError(f"more than {LOGINS} logins within a minute: wait a minute")
        self._links = {each: end for each, end in self._links.items() if end > now}
        given = token if isinstance(token, str) else ""
        found = next(
            (each for each in self._links if hmac.compare_digest(each.encode(), given.encode(errors="replace"))), None
        )
        if found is None:
            raise LoginError("this link has been used, or is older than ten minutes: start `shoal console` again")
        del self._links[found]
        secret = secrets.token_urlsafe(32)
        while len(self._sessions) >= MOST_SESSIONS:
            del self._sessions[min(self._sessions, key=self._sessions.__getitem__)]
        self._sessions[secret] = now
        return secret

    def is_logged_in(self, secret: str | None) -> bool:
        """Whether a cookie is that of a session, whose time begins anew."""
        now = self._clock()
        if secret is None or now - self._sessions.get(secret, float("-inf")) > SESSION_LIFETIME:
            self._sessions.pop(secret or "", None)
            return False
        self._sessions[secret] = now
        return True

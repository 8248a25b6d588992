"""Access of viewers: tokens, to watch or to operate, and origins of web pages."""

import hmac
import secrets
from collections.abc import Collection

DESKTOP_ORIGINS = ("file://", "null")
"""Origins of viewers that are no web pages; a page in a file sends the same, and needs the token, too."""


class ViewerAccess:
    """Tokens of one run of the console, and the origins of web pages that may use them.

    origins: as browsers send them, such as https://app.foxglove.dev.
    """

    def __init__(self, origins: Collection[str] = ()) -> None:
        self._origins = frozenset((*DESKTOP_ORIGINS, *origins))
        self._tokens = {operate: secrets.token_urlsafe(24) for operate in (False, True)}

    def token(self, *, operate: bool) -> str:
        """The token of those who may watch only, or also operate."""
        return self._tokens[operate]

    def may_operate(self, token: str) -> bool | None:
        """Whether the owner of a token may operate; None if it is no token."""
        given = token.encode(errors="replace")
        found = [operate for operate, known in self._tokens.items() if hmac.compare_digest(known.encode(), given)]
        return found[0] if found else None

    def allows_origin(self, origin: str, host: str) -> bool:
        """Whether a page of an origin may connect; programs have none."""
        return not origin or is_own_origin(origin, host) or origin in self._origins


def is_own_origin(origin: str, host: str) -> bool:
    """Whether an origin is the console itself, under the host (name and port) of the request."""
    return origin in (f"http://{host}", f"https://{host}")

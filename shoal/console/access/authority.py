"""Decides which orders a user may give, by role, list of consoles and lease, and writes them into the log book."""

from collections.abc import Callable, Mapping

from shoal.console.access.lease import LeaseError, Leases
from shoal.console.access.page_sessions import PageSession
from shoal.console.access.users import Role, User
from shoal.console.panels.user_panels import PRESS, PRESS_OF_MAINTAINER
from support.terminal_text import printable
from support.text_length import clip

OPERATING = ("abort", "hold", "surface", "put", "delete", "start", "stop", "pause", "resume", PRESS)
MAINTAINING = ("set", "save", "undo", PRESS_OF_MAINTAINER)
ROLES = {**dict.fromkeys(OPERATING, Role.OPERATE), **dict.fromkeys(MAINTAINING, Role.MAINTAIN)}
"""The roles that orders need."""
LONGEST_NOTE = 200  # characters

Journal = Callable[[str, str], object]
"""Writes a text into the log book of a vehicle: `journal(vehicle, text)`."""

Permit = Callable[[str, str, Mapping[str, object]], None]
"""Notes an order to a vehicle and raises AuthorityError if it may not be given: `permit(vehicle, order, words)`."""


class AuthorityError(Exception):
    """An order that a user may not give; the text is for the user."""


class Authority:
    """Decides on each order before it is sent.

    `journal` gets each order with the name of its user; `refusal(user)` is why a vehicle takes no orders of a user, or
    empty. Abort needs a role, and no lease.
    """

    def __init__(self, journal: Journal, refusal: Callable[[User], str] = lambda _: "") -> None:
        self.leases: Leases = Leases(journal)
        self._journal, self._refusal = journal, refusal
        self._aborters: dict[str, str] = {}

    def permit(self, session: PageSession, vehicle: str, order: str, words: Mapping[str, object]) -> None:
        """Note an order to a vehicle in its log book. Raises AuthorityError if the session may not give it."""
        if order not in ROLES:
            raise AuthorityError(f"no such order: {clip(order, LONGEST_NOTE)!r}")
        self.require_role(session.user, ROLES[order])
        if order == "abort":
            self._aborters[vehicle] = session.user.name
        else:
            self._require_lease(session, vehicle)
        self.note(vehicle, f"{session.user.name}: {printable(_order_text(order, words))}")

    def require_operator(self, session: PageSession, vehicle: str) -> None:
        """Raises AuthorityError unless the session may operate a vehicle and has its lease; it takes a free one."""
        self.require_role(session.user, Role.OPERATE)
        self._require_lease(session, vehicle)

    def aborter(self, vehicle: str) -> str:
        """The user who has aborted a vehicle last; empty if none has."""
        return self._aborters.get(vehicle, "")

    def note(self, vehicle: str, text: str) -> None:
        """Write a text into the log book of a vehicle."""
        self._journal(vehicle, text)

    def _require_lease(self, session: PageSession, vehicle: str) -> None:
        try:
            self.leases.require(vehicle, session.number, session.user.name)
        except LeaseError as error:
            raise AuthorityError(str(error)) from None

    def require_role(self, user: User, role: Role) -> None:
        """Raises AuthorityError if a user has not this role, or is not in the vehicle's list of consoles."""
        if reason := self.refusal(user, role):
            raise AuthorityError(reason)

    def refusal(self, user: User, role: Role) -> str:
        """The reason why a user may not do what needs a role; empty if the role is enough."""
        if user.role < role:
            return f"{user.name} may {user.role.word}: this needs the role {role.word}"
        return self._refusal(user)

    def change_lease(self, session: PageSession, vehicle: str, change: object) -> str:
        """Take, hand over or keep a lease; returns a sentence for the user. Raises AuthorityError."""
        self.require_role(session.user, Role.OPERATE)
        try:
            match change:
                case "take":
                    return self.leases.take(vehicle, session.number, session.user.name)
                case "hand over":
                    return self.leases.hand_over(vehicle, session.number)
                case "keep":
                    return self.leases.keep(vehicle, session.number)
                case _:
                    raise AuthorityError(f"no such change of a lease: {change!r}")
        except LeaseError as error:
            raise AuthorityError(str(error)) from None


def _order_text(order: str, words: Mapping[str, object]) -> str:
    """An order in the words of its user."""
    given = {name: value for name, value in words.items() if isinstance(value, str)}
    match order:
        case "start" | "delete":
            text = f"{order} {given.get('plan', '')}"
        case "set" | "undo":
            text = f"{order} {given.get('entity', '')}: {given.get('parameter', '')} = {given.get('value', '')}"
        case "press" | "press-maintain":
            text = f"press {given.get('panel', '')}: {given.get('button', '')}"
        case "save":
            text = f"save the parameters of {given.get('entity', '')}"
        case "put":
            text = "store a plan"
        case _:
            text = order
    return clip(text, LONGEST_NOTE)

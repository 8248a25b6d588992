"""A service of MAVLink: the messages that it answers, and what it does without being asked."""

from collections.abc import Callable, Mapping

from mavlink import ReceivedMessage
from mavlink.vehicle.session import Session

Handler = Callable[[Session, ReceivedMessage, float], None]
"""Answers a message of a session at a time."""


class MavlinkService:
    """One service for all sessions; most do nothing but answer.

    `handlers` answer messages, by name. Times are in s since 1970.
    """

    @property
    def handlers(self) -> Mapping[str, Handler]:
        return {}

    def check_timeouts(self, now: float) -> None:
        """Called once a second."""

    def poll(self, now: float) -> None:
        """Send what is due."""

    @property
    def next_deadline(self) -> float | None:
        """Time at which `poll` has something to do; None if only after a message."""
        return None

    def forget(self, session: Session) -> None:
        """Drop what is kept of a session that has lost its contact."""

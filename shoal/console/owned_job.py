"""A job beside the page that belongs to the user who has asked for it."""

import time
from collections.abc import Callable, Mapping
from typing import Any

from shoal.console.access.users import Role, User
from shoal.console.page_job import PageJob, PageJobError


def may_end(user: User, owner: User) -> bool:
    """Whether a user may end what belongs to another one, or to himself."""
    return user.name == owner.name or user.role >= Role.MAINTAIN


class OwnedJob:
    """Runs a module for one user at a time, like `PageJob`; only this one, and who may maintain, cancels it.

    `doing` are the words after the name of the user, such as "has a report made".
    """

    def __init__(self, module: str, doing: str) -> None:
        self._worker, self._doing = PageJob(module), doing
        self._owner: tuple[User, float] | None = None  # and since when

    @property
    def is_busy(self) -> bool:
        """Whether a job runs."""
        return self._owner is not None

    async def run(
        self, user: User, job: Mapping[str, Any], on_part: Callable[[dict[str, Any]], object] = lambda _: None
    ) -> dict[str, Any]:
        """The answer to a job. Raises PageJobError, which names the user whose job runs."""
        if self._owner is not None:
            owner, began = self._owner
            seconds = time.monotonic() - began
            raise PageJobError(f"{owner.name} {self._doing}, for {seconds:.0f} s now: wait until it is over")
        self._owner = user, time.monotonic()
        try:
            return await self._worker.run(job, on_part)
        finally:
            self._owner = None

    def cancel(self, user: User) -> str:
        """End the job that runs; returns why a user may not, or an empty text."""
        if self._owner is not None and not may_end(user, self._owner[0]):
            return f"{self._owner[0].name} {self._doing}, and may cancel it"
        self._worker.cancel()
        return ""

    def close(self) -> None:
        """End the job that runs: the console ends."""
        self._worker.cancel()

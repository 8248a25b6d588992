"""Opens zenoh's sessions, also where a process may not lock memory, as shared memory demands."""

import contextlib
from collections.abc import Callable
from typing import TYPE_CHECKING

from runtime.zenoh.config import set_option
from runtime.zenoh.tcp_user_timeout import LinkTimeout

if TYPE_CHECKING:
    import zenoh

ADVICE = "raise the limit (LimitMEMLOCK= of a systemd unit, ulimit -l of a shell)"


def describe_lockable_memory() -> str:
    """The amount of memory that this process may lock, for people."""
    with contextlib.suppress(ImportError):  # there is none on Windows
        import resource

        limit, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
        if limit != resource.RLIM_INFINITY:
            return f"this process may lock {limit / 2**20:.3g} MB of memory"
    return "the computer gives no shared memory"


class SessionFactory:
    """Opens zenoh sessions; without shared memory if this process may not have any, which it reports once.

    Their links to other computers end when those are silent.
    """

    def __init__(self, warn: Callable[[str], None] = lambda _: None) -> None:
        self.shares: bool = True
        self._warn = warn
        self._silence = LinkTimeout()

    def open(self, config: "zenoh.Config") -> "zenoh.Session":
        """Raises zenoh.ZError."""
        session = self._open(config)
        self._silence.add_session(session)
        return session

    def stop_link_timeout(self) -> None:
        """Call it before the sessions are closed."""
        self._silence.close()

    def _open(self, config: "zenoh.Config") -> "zenoh.Session":
        import zenoh

        if self.shares:
            try:
                return zenoh.open(config)
            except zenoh.ZError as error:
                if "shm" not in str(error).lower():
                    raise
            self.shares = False
            self._warn(
                f"zenoh: no shared memory, since {describe_lockable_memory()}: "
                f"frames take longer to other processes; {ADVICE}"
            )
        set_option(config, "transport/shared_memory/enabled", False)
        return zenoh.open(config)

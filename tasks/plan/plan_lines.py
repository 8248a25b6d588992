"""Lines of the log book about the plan that is carried out."""

from runtime import Task
from support.log_limit import LogLimit
from support.token_bucket import TokenBucket

AT_ONCE, RATE = 10.0, 0.5  # plans whose lines are logged: at once, per second in the long run
BRIEF = 2.0  # s; a plan that lasts longer is logged from then on


class PlanLines:
    """Logs what becomes of a plan; of plans that replace each other without end only some, and how many there were.

    A ground station may send a vehicle to another place 45 times a second, and each order is a plan with five lines.
    """

    def __init__(self, task: Task) -> None:
        self._task = task
        self._bucket = TokenBucket(RATE, AT_ONCE)
        self._failures = LogLimit("more plans fail")
        self._unlogged = 0
        self._began = task.now
        self._is_open = True

    def begin_plan(self, warning: str) -> None:
        """Begin another plan, with a line if there is a `warning`."""
        self._began = self._task.now
        if self._bucket.try_acquire(self._began):
            self._open()
            if warning:
                self._task.log.warning(warning)
            return
        if self._is_open:
            self._task.log.warning("more plans start one after the other, which are not logged one by one")
        self._is_open = False
        self._unlogged += 1

    def write(self, text: str) -> None:
        """Log a line about the plan."""
        if not self._is_open and self._task.now - self._began >= BRIEF:
            self._open()
        if self._is_open:
            self._task.log.info(text)

    def write_failure(self, reason: str) -> None:
        """Log why the plan has failed."""
        self._failures.write(self._task.log.error, reason, self._task.now)

    def _open(self) -> None:
        self._is_open = True
        if self._unlogged:
            self._task.log.warning(f"{self._unlogged} plans have started that were not logged one by one")
        self._unlogged = 0

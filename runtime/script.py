"""Sequential logic as a coroutine on the kernel: wait, hear, act, in the order it is written."""

import inspect
from collections.abc import Callable, Coroutine, Generator
from typing import TYPE_CHECKING, Any, TypeVar

import imc
from runtime.bus import Bus, Subscription
from runtime.kernel import SECOND, Timer

if TYPE_CHECKING:
    from runtime.task import Task

M = TypeVar("M", bound=imc.Message)


class _Pause:
    """Gives control to the kernel until the script is resumed; the value of `await` is what it is resumed with."""

    def __await__(self) -> Generator[None, Any, Any]:
        return (yield)


class Script:
    """A coroutine of a task: `async def dive(script): await script.sleep(2); state = await script.hear(...)`.

    It runs between the handlers, never beside them, and what it raises is the task's own error.
    """

    def __init__(self, task: "Task", bus: Bus, function: Callable[..., Coroutine[Any, Any, Any]], *args: Any):
        self.task = task
        self.done = False
        self.result: Any = None
        self._kernel = task.vehicle.kernel
        self._bus = bus
        self._subscriptions: list[Subscription] = []
        self._timer: Timer | None = None
        self._coroutine = function(self, *args)
        if not inspect.iscoroutine(self._coroutine):
            raise TypeError(f"{function!r} is no coroutine function: write async def")
        self._wake(0.0, None)

    @property
    def now(self) -> float:
        """Seconds since 1970 UTC."""
        return self.task.now

    def publish(self, message: imc.Message) -> imc.Message:
        return self.task.publish(message)

    def cancel(self) -> None:
        """End it where it waits, or in its own step where it waits next; its `finally` clauses run."""
        self.done = True
        if inspect.getcoroutinestate(self._coroutine) != inspect.CORO_RUNNING:
            self._forget()
            self._coroutine.close()

    async def sleep(self, seconds: float) -> None:
        self._wake(seconds, None)
        await _Pause()

    async def hear(
        self,
        kind: type[M],
        *,
        where: Callable[[M], bool] | None = None,
        timeout: float | None = None,
        others: bool = False,
    ) -> M:
        """The next message of a type that satisfies `where`, of the own system unless `others`.

        Raises TimeoutError after `timeout` seconds.
        """

        def heard(message: M) -> None:
            if subscription not in self._subscriptions:
                return
            try:
                wanted = where is None or where(message)
            except Exception as error:
                self._resume(error)
            else:
                if wanted:
                    self._resume(message)

        subscription = Subscription(kind, heard, self, others)
        self._subscriptions.append(subscription)
        self._bus.subscribe(subscription)
        if timeout is not None:
            self._wake(timeout, TimeoutError(f"no {kind.__name__} within {timeout:g} s"))
        return await _Pause()

    def _wake(self, seconds: float, value: Any) -> None:
        self._timer = self._kernel.at(self._kernel.now_ns + round(seconds * SECOND), self._resume, value)
        self._timer.owner = self.task

    def _forget(self) -> None:
        for subscription in self._subscriptions:
            self._bus.remove(subscription)
        self._subscriptions = []
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _resume(self, value: Any) -> None:
        if self.done:
            return
        self._forget()
        try:
            if isinstance(value, Exception):
                self._coroutine.throw(value)
            else:
                self._coroutine.send(value)
        except StopIteration as end:
            self.done, self.result = True, end.value
        except Exception as error:
            self.done = True
            self._kernel.on_error(self.task, error)
        else:
            if self.done:
                self.cancel()

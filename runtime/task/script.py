"""Sequential logic as a coroutine on the kernel: it waits, receives and acts in the order it is written."""

import inspect
from collections import deque
from collections.abc import Callable, Coroutine, Generator
from types import FrameType
from typing import TYPE_CHECKING, Any, TypeVar

import imc
from runtime.bus import Bus, Subscription
from runtime.kernel import Timer, to_ordinary_exception

if TYPE_CHECKING:
    from runtime.task.task import Task

M = TypeVar("M", bound=imc.Message)


async def _nothing(_: "Script") -> None:
    """The body of a script that has ended."""


class _Pause:
    """Gives control to the kernel; `await` returns the value with which the script is resumed."""

    def __await__(self) -> Generator[None, Any, Any]:
        return (yield)


class Inbox:
    """Collects messages of some types, in order, once opened: none is lost between two calls of `next`."""

    def __init__(self, script: "Script", kinds: tuple[type[imc.Message], ...], others: bool):
        self._script = script
        self._waiting = False
        self._messages: deque[imc.Message] = deque()
        self._subscriptions: list[Subscription] = []
        self.add_types(*kinds, others=others)

    def add_types(self, *kinds: type[imc.Message], others: bool = False) -> None:
        """Keep messages of these types as well."""
        for kind in kinds:
            subscription = Subscription(kind, self._take, self._script, others)
            self._subscriptions.append(subscription)
            self._script.bus.subscribe(subscription)

    async def next(self, timeout: float | None = None) -> imc.Message:
        """The next message. Raises TimeoutError after `timeout` seconds without one."""
        if self._messages:
            return self._messages.popleft()
        self._waiting = True
        try:
            return await self._script.pause(timeout, f"no message within {timeout or 0.0:g} s")
        finally:
            self._waiting = False

    def close(self) -> None:
        for subscription in self._subscriptions:
            self._script.bus.remove_subscription(subscription)
        self._subscriptions = []

    def _take(self, message: imc.Message) -> None:
        if not self._subscriptions:
            return
        if self._waiting:
            self._waiting = False
            self._script.resume(message)
        else:
            self._messages.append(message)


class Script:
    """A coroutine of a task: `async def dive(script): await script.sleep(2); state = await script.receive(...)`.

    It runs between the handlers, never at the same time. An exception in it is the task's error.
    """

    def __init__(self, task: "Task", bus: Bus, function: Callable[..., Coroutine[Any, Any, Any]], *args: Any):
        self.task = task
        self.done: bool = False
        self.result: Any = None
        self._kernel = task.vehicle.kernel
        self.bus = bus
        self._subscriptions: list[Subscription] = []
        self._inboxes: list[Inbox] = []
        self._timer: Timer | None = None
        self._coroutine = function(self, *args)
        if not inspect.iscoroutine(self._coroutine):
            raise TypeError(f"{function!r} is not a coroutine function: write async def")
        self._wake(0.0, None)

    @classmethod
    def create_ended_script(cls, task: "Task") -> "Script":
        """A script that has already ended."""
        script = cls(task, task.vehicle.bus, _nothing)
        script.cancel()
        return script

    @property
    def waiting_frames(self) -> list[FrameType]:
        """The place where it waits: the frames of its coroutines, the outermost first."""
        found: list[FrameType] = []
        inner: Any = self._coroutine
        while (frame := getattr(inner, "cr_frame", None)) is not None:
            found.append(frame)
            inner = inner.cr_await
        return found

    @property
    def now(self) -> float:
        """Seconds since 1970 UTC."""
        return self.task.now

    def publish(self, message: imc.Message) -> imc.Message:
        return self.task.publish(message)

    def cancel(self) -> None:
        """End it where it waits, or if it cancels itself, where it waits next; its `finally` clauses run."""
        self.done = True
        if inspect.getcoroutinestate(self._coroutine) != inspect.CORO_RUNNING:
            self._forget()
            self._end()
            self._coroutine.close()

    async def sleep(self, seconds: float) -> None:
        self._wake(seconds, None)
        await _Pause()

    async def receive(
        self,
        kind: type[M],
        *,
        where: Callable[[M], bool] | None = None,
        timeout: float | None = None,
        others: bool = False,
    ) -> M:
        """Wait for the next message of a type that satisfies `where`, of the own system unless `others`.

        Raises TimeoutError after `timeout` seconds.
        """

        def deliver(message: M) -> None:
            if subscription not in self._subscriptions:
                return
            try:
                wanted = where is None or where(message)
            except Exception as error:
                self.resume(error)
            else:
                if wanted:
                    self.resume(message)

        subscription = Subscription(kind, deliver, self, others)
        self._subscriptions.append(subscription)
        self.bus.subscribe(subscription)
        return await self.pause(timeout, f"no {kind.__name__} within {timeout or 0.0:g} s")

    def listen(self, *kinds: type[imc.Message], others: bool = False) -> Inbox:
        """Keep all messages of these types from now on, of the own system unless `others`, until the script ends."""
        inbox = Inbox(self, kinds, others)
        self._inboxes.append(inbox)
        return inbox

    async def pause(self, timeout: float | None, reason: str) -> Any:
        """Wait until resumed. Raises TimeoutError(reason) after `timeout` seconds."""
        if timeout is not None:
            self._wake(timeout, TimeoutError(reason))
        return await _Pause()

    def _wake(self, seconds: float, value: Any) -> None:
        self._timer = self._kernel.after(seconds, self.resume, value)
        self._timer.owner = self.task

    def _forget(self) -> None:
        for subscription in self._subscriptions:
            self.bus.remove_subscription(subscription)
        self._subscriptions = []
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _end(self) -> None:
        for inbox in self._inboxes:
            inbox.close()
        self._inboxes = []

    def resume(self, value: Any) -> None:
        """Continue with `value`; if it is an exception, raise it in the script."""
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
            self._end()
        except BaseException as error:
            self.done = True
            self._end()
            self._kernel.on_error(self.task, to_ordinary_exception(error))
        else:
            if self.done:
                self.cancel()

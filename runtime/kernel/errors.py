"""Errors of handlers, and what a kernel does with them unless its owner decides (see `Vehicle.on_task_error`)."""

import logging

from runtime.kernel.timer import owner_title

logger: logging.Logger = logging.getLogger("shoal.kernel")


class HandlerBlockedError(BaseException):
    """Raised by a watchdog inside a handler that does not return; no `except Exception` of the handler stops it."""


class LivelockError(RuntimeError):
    """Events cause each other without time passing; `owner` handled the last of them."""

    def __init__(self, events: int, owner: object):
        super().__init__(f"{events} events without time passing, the last in {owner_title(owner)}")
        self.owner = owner


class HandlerError(Exception):
    """A handler did what no handler may do: it blocked the vehicle, or tried to end the program."""


class SimulatedCrash(RuntimeError):
    """A failure on purpose: its task restarts as on a vehicle, also in a run that another exception would end."""


def to_ordinary_exception(error: BaseException) -> Exception:
    """`error`, or one with its meaning; raises those that are meant for the program: KeyboardInterrupt."""
    if isinstance(error, Exception):
        return error
    if isinstance(error, HandlerBlockedError):
        text = f"the handler did not return: {error}" if error.args else "the handler did not return"
    elif isinstance(error, SystemExit):
        text = f"the handler tried to end the program: sys.exit({error.code if error.code is not None else ''})"
    elif isinstance(error, KeyboardInterrupt):
        raise error
    else:
        text = f"the handler raised {type(error).__name__}: {error}"
    made = HandlerError(text).with_traceback(error.__traceback__)
    made.__suppress_context__ = True
    return made


def raise_error(_: object, error: Exception) -> None:
    raise error


def warn_slow(owner: object, seconds: float, handler: str) -> None:
    logger.warning("%s computed for %.3f s in one handler, %s", owner_title(owner), seconds, handler)

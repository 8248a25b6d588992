"""A process that ends with the one that has started it, however that one ended."""

import os
from collections.abc import Callable

from runtime.kernel import Kernel

POLL_PERIOD = 0.25  # s


def stop_with_parent(kernel: Kernel, parent: int, stop: Callable[[], object]) -> None:
    """Call `stop()` once `parent`, the id of the process that has started this one, is gone."""

    def poll() -> None:
        if os.getppid() != parent:
            stop()
        else:
            kernel.after(POLL_PERIOD, poll)

    kernel.soon(poll)

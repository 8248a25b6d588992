"""The keys that control a replay on a terminal: space pauses, arrows skip back and forward."""

import os
import sys
import termios
import tty
from collections.abc import Generator
from contextlib import contextmanager
from typing import Protocol

from runtime.kernel import Kernel

STEP, LEAP = 10.0, 60.0  # s
ARROWS = {b"\x1b[D": -STEP, b"\x1b[C": STEP, b"\x1b[B": -LEAP, b"\x1b[A": LEAP}
LONGEST = 64


class ReplayControls(Protocol):
    """Playback that the keys control."""

    @property
    def paused(self) -> bool: ...
    def pause(self) -> None: ...
    def resume(self) -> None: ...
    def skip(self, seconds: float) -> None:
        """Skip forward, or back if `seconds` is negative."""
        ...


@contextmanager
def replay_keyboard(player: ReplayControls, kernel: Kernel) -> Generator[None]:
    """Read single keys from the terminal in this context; does nothing in a pipe or in the background."""
    if not (sys.stdin.isatty() and sys.stdout.isatty() and os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()):
        yield
        return
    file = sys.stdin.fileno()

    def read() -> None:
        keys = os.read(file, LONGEST)
        if not keys:
            kernel.unwatch(sys.stdin)
        handle_keys(player, keys)

    before = termios.tcgetattr(file)
    tty.setcbreak(file)
    kernel.watch(sys.stdin, read)
    try:
        yield
    finally:
        termios.tcsetattr(file, termios.TCSADRAIN, before)


def handle_keys(player: ReplayControls, keys: bytes) -> None:
    """Do what the keys mean; other keys are ignored."""
    while keys:
        key = next((key for key in ARROWS if keys.startswith(key)), keys[:1])
        if key in ARROWS:
            player.skip(ARROWS[key])
        elif key == b" ":
            (player.resume if player.paused else player.pause)()
        keys = keys[len(key) :]

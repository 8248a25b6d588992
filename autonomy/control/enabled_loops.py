"""Tracks which control loops ControlLoops has enabled."""

import imc


class EnabledLoops:
    """The loops of `controlled` (CLoopsMask) that are enabled.

    The `mask` is a plain integer: operators of enumerations take ten times as long, and controllers use many.
    `scope` is the largest scope_ref received; messages with a smaller one come too late and are ignored.
    """

    def __init__(self, controlled: int):
        self.controlled: int = int(controlled)
        self.mask: int = 0
        self.scope: int = 0

    def receive(self, message: imc.ControlLoops) -> bool:
        """Apply a message; True if it changed the mask."""
        if message.scope_ref < self.scope:
            return False
        self.scope = message.scope_ref
        before = self.mask
        if message.enable:
            self.mask |= message.mask & self.controlled
        else:
            self.mask &= ~message.mask
        return self.mask != before

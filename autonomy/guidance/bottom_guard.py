"""Keeps a vehicle that holds a depth away from a rising bottom."""

HYSTERESIS = 0.5  # m


class BottomGuard:
    """Decides when to hold an altitude instead of a depth: when the depth is nearer to the bottom than `lowest` (m).

    Only the bottom below the altimeter counts, not what is ahead.
    """

    def __init__(self, lowest: float):
        self._lowest = lowest
        self.active: bool = False

    def update(self, wanted: float, depth: float, altitude: float) -> bool:
        """Take the desired depth, the vehicle's depth, and its altitude (m, negative if unknown).

        Returns True if `active` has changed.
        """
        if altitude < 0.0:
            return False
        before, deepest = self.active, max(0.0, depth + altitude - self._lowest)
        if self.active:
            self.active = wanted > deepest - HYSTERESIS
        else:
            self.active = altitude < self._lowest and wanted > deepest
        return self.active != before

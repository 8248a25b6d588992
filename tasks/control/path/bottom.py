"""Keeps a vehicle that is to keep a depth away from a bottom that rises."""

HYSTERESIS = 0.5  # m


class BottomGuard:
    """Says when to keep an altitude in place of a depth: where the depth is nearer to the bottom than `lowest` (m).

    Only what the altimeter sees below counts, not what is ahead.
    """

    def __init__(self, lowest: float):
        self._lowest = lowest
        self.active = False

    def watch(self, wanted: float, depth: float, altitude: float) -> bool:
        """Take the depth that is wanted, that of the vehicle, and its altitude (m, negative if unknown).

        Returns whether the answer, `active`, has changed.
        """
        if altitude < 0.0:
            return False
        before, deepest = self.active, max(0.0, depth + altitude - self._lowest)
        if self.active:
            self.active = wanted > deepest - HYSTERESIS
        else:
            self.active = altitude < self._lowest and wanted > deepest
        return self.active != before

"""`Failsafe` alone, with messages of others."""

import imc
from runtime.testing import simulate
from tasks.supervisors.failsafe import Failsafe

Loops = imc.CLoopsMask
LIMITS = {"General": {"Absolute Maximum Depth": "50", "Underwater Depth Threshold": "0.3"}}
REQUIRED = ["EstimatedState", "PathControlState: PATH YAW"]
ON = imc.ControlLoops(timestamp=0.5, enable=1, mask=Loops.PATH, scope_ref=4)


def every(kind, period, until, begin=0.0, **fields):
    """Messages at a period, from `begin` to `until` (s)."""
    return [kind(timestamp=begin + period * k, **fields) for k in range(round((until - begin) / period))]


def guarded(*feed, seconds=10.0, **parameters):
    """A run of `Failsafe` with these messages of others."""
    options = {"required_messages": REQUIRED, "thrusters": [0], "servos": [0, 1], "settings": LIMITS}
    return simulate(Failsafe, sorted(feed, key=lambda m: m.timestamp), seconds=seconds, **{**options, **parameters})

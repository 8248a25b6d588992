"""What tests of the controllers of an underwater vehicle share."""

import imc

Loops = imc.CLoopsMask
AFTER = 0.02  # s; a run continues this long after its feed


def enable(mask, scope=1, time=0.1, on=1):
    return imc.ControlLoops(timestamp=time, enable=on, mask=mask, scope_ref=scope)


def states(seconds, start=0.2, **fields):
    fields = {"alt": -1.0} | fields
    return [imc.EstimatedState(timestamp=start + 0.05 * i, **fields) for i in range(round(seconds * 20))]


def before_end(run, kind):
    """The messages of a type, without those published when the task stops."""
    end = run.vehicle.kernel.now_ns * 1e-9
    return [m for m in run.of(kind) if m.timestamp < end - 0.5 * AFTER]

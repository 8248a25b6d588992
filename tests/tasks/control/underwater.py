"""What tests of the controllers of underwater vehicles and boats share."""

import imc

Loops = imc.CLoopsMask
AFTER = 0.02  # s; a run continues this long after its feed


def enable(mask, scope=1, time=0.1, on=1):
    return imc.ControlLoops(timestamp=time, enable=on, mask=mask, scope_ref=scope)


STOPS = [
    imc.Abort(timestamp=1.0, src=0x1234, dst=0x1A),
    imc.Abort(timestamp=1.0, src=0x1234, dst=0xFFF0),
    imc.Abort(timestamp=1.0, src=0x4000, dst=0xFFFF),
    imc.Brake(timestamp=1.0, op=imc.Brake.Op.START),
    enable(Loops.ALL, scope=2, time=1.0, on=0),
]


def states(seconds, start=0.2, **fields):
    fields = {"alt": -1.0} | fields
    return [imc.EstimatedState(timestamp=start + 0.05 * i, **fields) for i in range(round(seconds * 20))]


def before_end(run, kind):
    """The messages of a type, without those published when the task stops."""
    end = run.vehicle.kernel.now_ns * 1e-9
    return [m for m in run.of(kind) if m.timestamp < end - 0.5 * AFTER]
